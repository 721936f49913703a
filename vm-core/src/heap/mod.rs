//! The layout of heap cells, and the collector.
//!
//! Every cell is a header and six slots. The header's tag byte holds the cell's kind and the
//! collector's marks, its
//! payload links to the next cell of the same object. The other slots are values (unused ones nil),
//! so the collector
//! treats all cells alike:
//!
//! | kind | slots 1 to 6 | link |
//! |---|---|---|
//! | table | array chain, length of the array, two pairs of key and value | pairs |
//! | array | six values, for keys 6 n, 6 n + 1, ... | array |
//! | pairs | three pairs | pairs |
//! | closure | function, self, four captured values | captures |
//! | captures | six captured values | captures |
//! | bound | function or closure, self | none |
//! | text | length, 20 bytes in five integers | text continued |
//! | text continued | 24 bytes in six integers | text continued |

mod closure;
mod collect;
mod table;
mod text;

pub(crate) use table::ITERATION;
pub(crate) use table::{VISIT, Visit};
pub(crate) use text::{TextBuilder, TextCursor};

use crate::value::Tag;

/// Header tag of a cell in use, whatever it holds: only the collector reads it. As that of nil it costs nothing to set.
pub(crate) const LIVE: Tag = Tag::NIL;
/// Header tag of a free cell.
pub(crate) const FREE: Tag = Tag::of(2);

/// There was no cell: collect, then try again; if that fails too, the heap is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NoCell;
