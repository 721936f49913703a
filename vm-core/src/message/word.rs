//! Words: the payloads of values on their way.
//!
//! A string's number travels as the sum with the low bits of the script's hash: what another script's robot sends is hardly ever
//! the number of a string here.

use super::{Ignored, Script};
use crate::number::Profile;
use crate::value::{Tag, Value};

/// The word of a value that fits a frame.
#[inline(never)]
pub(super) fn to_word<P: Profile>(value: Value<P>, script: Script) -> P::Raw {
    match value.tag() {
        Tag::NIL => P::ZERO,
        Tag::STRING => P::raw_from_u16(P::raw_to_u16(value.raw()).wrapping_add(script.hash as u16)),
        _ => value.raw(),
    }
}

/// The value of a word.
#[inline(never)]
pub(super) fn value<P: Profile>(
    tag: Tag,
    word: P::Raw,
    script: Script,
) -> Result<Value<P>, Ignored> {
    match tag {
        Tag::NIL => Ok(Value::nil()),
        Tag::STRING => {
            let low = P::raw_to_u16(word);
            let number = low.wrapping_sub(script.hash as u16);
            let same = P::raw_from_u16(low) == word && number < script.strings;
            if same { Ok(Value::string(number)) } else { Err(Ignored::Foreign) }
        }
        _ => Ok(Value::new(tag, word)),
    }
}
