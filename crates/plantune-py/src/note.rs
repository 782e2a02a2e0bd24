//! Notes across the border.

use plantune_core::Note;
use pyo3::prelude::*;

/// A note as the dict behind `plantune.Note(**d)`.
#[derive(IntoPyObject)]
pub struct NoteOut {
    code: &'static str,
    severity: &'static str,
    #[pyo3(item("where"))]
    place: Option<(String, Option<usize>, Option<f64>)>,
    count: Option<usize>,
    measured: Option<f64>,
    limit: Option<f64>,
    remedy: String,
    text: String,
}

impl From<&Note> for NoteOut {
    fn from(note: &Note) -> Self {
        NoteOut {
            code: note.code,
            severity: note.severity.as_str(),
            place: note.place.as_ref().map(|p| (p.column.clone(), p.row, p.time)),
            count: note.count,
            measured: note.measured,
            limit: note.limit,
            remedy: note.remedy.clone(),
            text: note.text.clone(),
        }
    }
}

pub fn notes(notes: &[Note]) -> Vec<NoteOut> {
    notes.iter().map(NoteOut::from).collect()
}
