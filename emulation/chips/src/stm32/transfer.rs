//! A data item of a DMA transfer.

use super::Width;

/// A data item that the DMA controller moves. The memory belongs to the core: a `Transfer`
/// describes the data, and the owner of the memory moves it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// The address of the source and its width.
    pub from: (u32, Width),
    /// The address of the destination and its width; the value is zero-extended or truncated.
    pub to: (u32, Width),
}
