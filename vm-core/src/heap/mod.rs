//! The layout of heap cells, and the collector.
//!
//! Every cell is a header and six slots. The header's tag byte holds the state of the cell, [`LIVE`] or
//! [`FREE`], and during a collection the collector's mark. Its payload links to the next cell of the
//! same object, or of the free list. The other slots hold values, and nil where they are not used. The
//! collector does not know what an object is: it treats all cells alike.
//!
//! | object | slots 1 to 6 | link |
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
mod pausing;
mod table;
mod text;

pub use pausing::{Collection, CollectionState};
pub(crate) use pausing::{Phase, Progress, Repeat};
pub(crate) use table::ITERATION;
pub(crate) use table::{VISIT, Visit};
pub(crate) use text::{TextBuilder, TextCursor, TextPart};

use crate::value::Tag;

/// The header tag of a cell in use; only the collector reads it. It is the tag of nil, so a new cell,
/// which is all nil, already has it.
pub(crate) const LIVE: Tag = Tag::NIL;
/// The header tag of a free cell.
pub(crate) const FREE: Tag = Tag::of(2);

/// The error of an allocation that found no cell. The caller collects and tries again; if that fails
/// too, the heap is full.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NoCell;
