"use strict";
// Draws every figure of the page from the JSON beside it.
(() => {
  const narrow = window.matchMedia("(max-width: 640px)").matches;
  const touch = window.matchMedia("(pointer: coarse)").matches;
  // The page sends nothing anywhere, not even on a click.
  const settings = { responsive: true, displayModeBar: false, showSendToCloud: false, plotlyServerURL: "" };
  const places = [];
  for (const spec of document.querySelectorAll("script[data-figure]")) {
    const place = document.getElementById(spec.dataset.figure);
    const { data, layout } = JSON.parse(spec.textContent);
    if (narrow) {
      layout.font = { size: 12 };
      layout.margin = { ...layout.margin, l: 4, r: 6 };
    }
    // A finger on a figure scrolls the page.
    if (touch) layout.dragmode = false;
    Plotly.newPlot(place, data, layout, settings);
    places.push([place, layout.height]);
  }
  // On paper: a width that fits A4 and letter, and two figures to a page.
  const [width, share] = [680, 0.78];
  const resize = (place, change, height) => {
    place.style.height = `${height}px`;
    Plotly.relayout(place, { ...change, height });
  };
  window.addEventListener("beforeprint", () => {
    for (const [place, height] of places) resize(place, { width }, Math.round(share * height));
  });
  window.addEventListener("afterprint", () => {
    for (const [place, height] of places) resize(place, { width: null, autosize: true }, height);
  });
})();
