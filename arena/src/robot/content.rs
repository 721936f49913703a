//! Values of scripts, as far as they can be seen from outside.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::number::Profile;

/// What a variable holds, as far as it can be seen from outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Content {
    /// nil, or nothing.
    Nil,
    /// A number.
    Number(f64),
    /// The number of a string.
    Text(u16),
    /// A table, a function, or a string that was made at run time.
    Other,
}

pub fn content<P: Profile>(value: Option<Value<P>>) -> Content {
    let Some(value) = value.filter(|value| !value.is_nil()) else { return Content::Nil };
    if let Some(integer) = value.as_int() {
        return Content::Number(f64::from(integer));
    }
    match (value.as_f32(), value.as_string()) {
        (Some(float), _) => Content::Number(f64::from(float)),
        (None, Some(number)) => Content::Text(number),
        (None, None) => Content::Other,
    }
}

/// A key of a stigmergy or a table.
pub fn value<P: Profile>(key: Content) -> Value<P> {
    match key {
        Content::Number(number) => Value::int(number as i32),
        Content::Text(number) => Value::string(number),
        Content::Nil | Content::Other => Value::nil(),
    }
}
