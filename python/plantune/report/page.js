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
    places.push(place);
  }
  const paper = 680; // pixels that fit on A4 and on letter
  window.addEventListener("beforeprint", () => places.forEach((p) => Plotly.relayout(p, { width: paper })));
  window.addEventListener("afterprint", () =>
    places.forEach((p) => Plotly.relayout(p, { width: null, autosize: true })));
})();
