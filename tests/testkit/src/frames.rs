//! Frames of messages, as any robot with that script would send them.

use bittybuzz_vm_core::message::content::{ContentItem, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    FRAGMENT_HEAD, FULL_FRAME, Fragment, Message, ScriptIdentity, TINY_FRAME,
};
use bittybuzz_vm_core::number::Profile;

/// Returns the frame of a message.
///
/// # Panics
/// If the message does not fit.
pub fn frame<P: Profile>(script: ScriptIdentity, message: &Message<'_, P>) -> Vec<u8> {
    let mut room = [0; FULL_FRAME];
    let length = message.encode(script, &mut room);
    let length = length.unwrap_or_else(|| panic!("{message:?} does not fit"));
    room[..length].to_vec()
}

/// Returns the frames of a long message of one robot: topic or key, and value.
///
/// # Panics
/// If the message does not fit.
pub fn fragments<P: Profile>(
    script: ScriptIdentity,
    robot: u16,
    head: Head,
    items: &[ContentItem<P>],
) -> Vec<Vec<u8>> {
    let mut room = [0; 64];
    let mut writer = ContentWriter::new(&mut room, script, head);
    items.iter().for_each(|item| writer.item(*item));
    let length = writer.finish().expect("there is room");
    let piece = if P::FULL { FULL_FRAME } else { TINY_FRAME } - FRAGMENT_HEAD;
    let parts = room[..length].chunks(piece);
    let (number, count) = (room[0], parts.len());
    let fragments = parts.enumerate().map(|(index, content)| {
        let (last, index) = (index + 1 == count, index as u8);
        frame::<P>(script, &Message::Fragment(Fragment { robot, number, index, last, content }))
    });
    fragments.collect()
}
