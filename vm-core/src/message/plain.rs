//! Conversion between messages and frames, for tools that inspect them outside of a machine.

use super::frame::Frame;
use super::{CLOCK_MAX, Fragment, FrameKind, Ignored, Message, ScriptIdentity};
use crate::number::Profile;

impl<'a, P: Profile> Message<'a, P> {
    /// Reads a frame. Bytes after those of the message are ignored.
    pub fn decode(bytes: &'a [u8], script: ScriptIdentity) -> Result<Self, Ignored> {
        if let Some(fragment) = Fragment::parse(bytes) {
            return Ok(Message::Fragment(fragment));
        }
        let mut frame = Frame::<P>::EMPTY;
        for (to, from) in frame.bytes_mut().iter_mut().zip(bytes) {
            *to = *from;
        }
        let kind = frame.open(bytes.len(), &script)?;
        let robot = frame.robot();
        Ok(match kind {
            FrameKind::Beacon => Message::Beacon { robot },
            FrameKind::Digest => {
                let (digest, floor) = frame.digest();
                Message::Digest { robot, digest, floor }
            }
            FrameKind::Swarms => Message::Swarms { robot, swarms: frame.swarms() },
            // It has no content.
            FrameKind::Fragment => return Err(Ignored::Malformed),
            FrameKind::Broadcast => {
                let (topic, value) = frame.broadcast();
                Message::Broadcast { robot, topic, value }
            }
            FrameKind::Entry => Message::Entry(frame.entry()),
        })
    }

    /// Writes the frame and returns its length. Returns `None` if the message has no frame, or if
    /// there is no room for it.
    pub fn encode(&self, script: ScriptIdentity, bytes: &mut [u8]) -> Option<usize> {
        let mut frame = Frame::<P>::EMPTY;
        match self {
            Message::Fragment(fragment) if fragment.content.is_empty() => return None,
            Message::Fragment(fragment) => {
                let (head, rest) = bytes.split_first_chunk_mut()?;
                *head = fragment.head();
                rest.get_mut(..fragment.content.len())?.copy_from_slice(fragment.content);
                return Some(head.len().wrapping_add(fragment.content.len()));
            }
            Message::Beacon { robot } => frame.put_beacon(*robot),
            Message::Digest { digest, floor, .. } if *digest >> 24 != 0 || *floor > CLOCK_MAX => {
                return None;
            }
            Message::Digest { robot, digest, floor } => {
                frame.put_digest(*robot, *digest, *floor);
            }
            Message::Swarms { robot, swarms } => frame.put_swarms(*robot, swarms),
            Message::Broadcast { robot, topic, value } => {
                frame.put_broadcast(*robot, *topic, *value)?;
            }
            Message::Entry(entry) if entry.clock > CLOCK_MAX => return None,
            Message::Entry(entry) => frame.put_entry(entry, 0)?,
        }
        let length = frame.seal(&script)?;
        bytes.get_mut(..length)?.copy_from_slice(frame.bytes(length));
        Some(length)
    }
}
