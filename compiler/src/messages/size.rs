//! The sizes of contents and frames, measured with the encoder of the machine.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::content::{ContentItem, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    FRAGMENT_HEAD, FRAGMENTS_MAX, FULL_FRAME, ScriptIdentity, TINY_FRAME,
};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

use crate::profile::NumberProfile;

/// The longest content of both profiles.
const CONTENT_MAX: usize = FRAGMENTS_MAX as usize * (FULL_FRAME - FRAGMENT_HEAD);

/// The number of bytes that the parts of a content take in a profile.
#[derive(Debug, Clone, Copy)]
pub struct ContentSizes {
    /// The content of a broadcast, before the topic.
    pub broadcast: usize,
    /// The content of an entry, before the key.
    pub entry: usize,
    pub nil: usize,
    /// A number or a constant string.
    pub word: usize,
    pub function: usize,
    /// A table, before its keys and values.
    pub table: usize,
    /// A string made at run time, before its bytes.
    pub text: usize,
    /// The bytes of a content that one fragment carries.
    fragment: usize,
}

impl ContentSizes {
    /// Measures the sizes of a profile.
    pub fn of(profile: NumberProfile) -> Self {
        match profile {
            NumberProfile::Tiny => sizes::<Tiny>(TINY_FRAME),
            NumberProfile::Full => sizes::<Full>(FULL_FRAME),
        }
    }

    /// Returns the number of fragments of a content.
    pub fn fragments(&self, content: usize) -> usize {
        content.div_ceil(self.fragment)
    }
}

fn sizes<P: Profile>(frame: usize) -> ContentSizes {
    let entry = Head::Entry { stigmergy: 0, owner: 0, clock: 0, digest: 0 };
    let broadcast = content::<P>(Head::Broadcast, None);
    let item = |item| content::<P>(Head::Broadcast, Some(item)) - broadcast;
    ContentSizes {
        broadcast,
        entry: content::<P>(entry, None),
        nil: item(ContentItem::Plain(Value::nil())),
        word: item(ContentItem::Plain(Value::int(0))),
        function: item(ContentItem::Function(0)),
        table: item(ContentItem::Table(0)),
        text: item(ContentItem::Text(0)),
        fragment: frame - FRAGMENT_HEAD,
    }
}

/// Returns the length of a content with at most one item.
fn content<P: Profile>(head: Head, item: Option<ContentItem<P>>) -> usize {
    let script = ScriptIdentity { hash: 0, strings: 0 };
    let mut room = [0; CONTENT_MAX];
    let mut writer = ContentWriter::new(&mut room, script, head);
    item.into_iter().for_each(|item| writer.item(item));
    writer.finish().expect("one item fits the longest content")
}
