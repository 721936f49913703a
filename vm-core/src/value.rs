//! Values: a tag and the profile's payload.
//!
//! Only values whose tag has [`Tag::HEAP_BIT`] refer to the heap; all others are complete in
//! themselves.

#[cfg(target_arch = "avr")]
use crate::byte::Byte;
use crate::number::wide::IS_WIDE;
use crate::number::{Float, Number, Profile};
use crate::slots::Pair;

/// The kind of a value. It is a plain byte, because the same slots also hold frame records and cell
/// headers. The tag of nil is zero, so that empty memory is nil.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Tag(Byte);

/// On 32-bit chips `Option<Value>` and `Result<Value, _>` fit the registers without a spare value
/// of the tag.
#[cfg(not(target_arch = "avr"))]
type Byte = u8;

impl Tag {
    /// nil
    pub const NIL: Tag = Tag::of(0);
    /// Integer. Its tag and that of nil differ in one bit only, so that one test finds the values
    /// that can be false.
    pub const INT: Tag = Tag::of(1);
    /// Float.
    pub const FLOAT: Tag = Tag::of(2);
    /// Constant string, by number.
    pub const STRING: Tag = Tag::of(3);
    /// Script function that captures nothing, by number.
    pub const FUNCTION: Tag = Tag::of(4);
    /// Built-in function, by number.
    pub const BUILTIN: Tag = Tag::of(5);
    /// Robot function, by import number.
    pub const ROBOT: Tag = Tag::of(6);
    /// Library: its number in the low byte, the object's number in the high byte.
    pub const LIBRARY: Tag = Tag::of(7);
    /// An argument that was not passed. Scripts never hold it.
    pub const UNSET: Tag = Tag::of(8);
    /// The bit that is set in the tags of references to cells.
    pub const HEAP_BIT: u8 = 0x10;
    /// Table.
    pub const TABLE: Tag = Tag::of(0x10);
    /// Function with captured values.
    pub const CLOSURE: Tag = Tag::of(0x11);
    /// Function bound to a table, its self.
    pub const BOUND: Tag = Tag::of(0x12);
    /// String made at run time.
    pub const TEXT: Tag = Tag::of(0x13);
    /// Snapshot of neighbors with a value for each: a table that has functions.
    pub const SNAPSHOT: Tag = Tag::of(0x15);
    /// The chain of array cells, in the head of a table. Scripts never hold it.
    pub const CHAIN: Tag = Tag::of(0x14);

    /// Returns the tag of that byte, or another number up to 254 in place of a tag.
    #[hot]
    pub(crate) const fn of(byte: u8) -> Tag {
        #[cfg(target_arch = "avr")]
        let byte = Byte::of(byte);
        Tag(byte)
    }

    /// Returns the byte of the tag.
    #[hot]
    #[allow(clippy::unnecessary_cast, reason = "on the AVR it is needed")]
    pub(crate) const fn byte(self) -> u8 {
        self.0 as u8
    }
}

/// The type of a value as scripts and people see it.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[repr(u8)]
pub enum Type {
    /// nil
    Nil,
    /// integer
    Int,
    /// float
    Float,
    /// string
    String,
    /// table, also libraries and their objects
    Table,
    /// any function
    Closure,
    /// an argument that was not passed
    Unset,
}

impl Type {
    /// Every type.
    pub const ALL: [Type; 7] =
        [Type::Nil, Type::Int, Type::Float, Type::String, Type::Table, Type::Closure, Type::Unset];

    /// Returns the name that `type()` gives.
    pub const fn name(self) -> &'static str {
        match self {
            Type::Nil => "nil",
            Type::Int => "integer",
            Type::Float => "float",
            Type::String => "string",
            Type::Table => "table",
            Type::Closure => "closure",
            Type::Unset => "an argument that was not passed",
        }
    }
}

/// Classes of values that can be sent, by their bits in a row of the image's class table.
pub mod class {
    use super::{Tag, class_bit};

    /// nil
    pub const NIL: u8 = 1 << class_bit(Tag::NIL.byte());
    /// An integer or a float.
    pub const NUMBER: u8 = 1 << class_bit(Tag::INT.byte()) | 1 << class_bit(Tag::FLOAT.byte());
    /// A constant string.
    pub const STRING: u8 = 1 << class_bit(Tag::STRING.byte());
    /// A string made at run time.
    pub const TEXT: u8 = 1 << class_bit(Tag::TEXT.byte());
    /// A table.
    pub const TABLE: u8 = 1 << class_bit(Tag::TABLE.byte());
    /// A function.
    pub const FUNCTION: u8 = 1 << class_bit(Tag::FUNCTION.byte());
}

/// Returns the number of the class bit of a tag: a number up to 7 that no other tag of a value that
/// can be sent has. It is not computed from [`Type`], because finding the type takes an AVR 20
/// cycles more.
const fn class_bit(tag: u8) -> u8 {
    tag.wrapping_add(tag >> 2) & 7
}

/// The only bit in which the tags of nil and integers differ.
const FALSE_BIT: u8 = Tag::INT.byte() ^ Tag::NIL.byte();

/// A value, or another occupant of a slot of the arena.
#[derive(Clone, Copy, Debug)]
pub struct Value<P: Profile>(P::Pair);

impl<P: Profile> Value<P> {
    /// The least number of bytes that a value takes. Where slots are padded for speed they take
    /// more.
    pub const SLOT_BYTES: usize = 1 + size_of::<P::Raw>();

    /// nil, of which all bits are zero.
    pub(crate) const NIL: Self = Value(P::Pair::NIL);

    /// Makes a slot with any tag and payload.
    #[hot]
    pub(crate) fn new(tag: Tag, raw: P::Raw) -> Self {
        Value(P::Pair::new(tag, raw))
    }

    /// Makes a slot whose payload is an index.
    #[hot]
    pub(crate) fn indexed(tag: Tag, index: u16) -> Self {
        Self::new(tag, P::raw_from_u16(index))
    }

    /// Makes a slot with a number up to 254, known at run time only, in place of a tag. This is a
    /// function of its own, because the AVR's compiler would merge the computation of the number
    /// with the match of [`Tag::of`], and then would not see that the match changes nothing.
    #[one_copy]
    pub(crate) fn marked(number: u8, raw: P::Raw) -> Self {
        Self::new(Tag::of(number), raw)
    }

    /// Returns the tag and the payload as numbers, which are both 0 for nil.
    #[hot]
    pub fn parts(self) -> (u8, u32) {
        (self.tag().byte(), P::int_to_i32(self.raw()) as u32)
    }

    /// Returns the slot of which [`Value::parts`] returned these numbers.
    #[hot]
    pub fn from_parts(tag: u8, payload: u32) -> Self {
        Self::new(Tag::of(tag), P::int_from_i32(payload as i32))
    }

    /// nil
    #[hot]
    pub fn nil() -> Self {
        Self::NIL
    }

    /// Returns the placeholder for an argument that was not passed.
    #[hot]
    pub(crate) fn unset() -> Self {
        Self::indexed(Tag::UNSET, 0)
    }

    /// Makes an integer. Bits that the profile lacks are dropped.
    #[hot]
    pub fn int(value: i32) -> Self {
        Self::new(Tag::INT, P::int_from_i32(value))
    }

    /// Makes the integer 1 for true, 0 for false.
    #[hot]
    pub fn truth(value: bool) -> Self {
        Self::indexed(Tag::INT, value as u16)
    }

    /// Makes the nearest float of the profile.
    #[hot]
    pub fn float(value: f32) -> Self {
        Self::new(Tag::FLOAT, P::float_from_f32(value))
    }

    /// Makes the float nearest to an integer. On the AVR this is much less work than
    /// [`Value::float`].
    pub fn float_from_int(value: i32) -> Self {
        Self::packed(&Self::int(value).unpack_float())
    }

    /// Makes a constant string.
    #[hot]
    pub fn string(number: u16) -> Self {
        Self::indexed(Tag::STRING, number)
    }

    /// Makes the nearest float of the profile from an unpacked one.
    #[hot]
    pub(crate) fn packed(value: &Float<P>) -> Self {
        Self::new(Tag::FLOAT, P::pack(value))
    }

    #[hot]
    pub(crate) fn tag(self) -> Tag {
        self.0.tag()
    }

    #[hot]
    pub(crate) fn raw(self) -> P::Raw {
        self.0.raw()
    }

    /// Returns the payload as an index.
    #[hot]
    pub(crate) fn index(self) -> usize {
        P::raw_to_u16(self.raw()) as usize
    }

    #[hot]
    pub(crate) fn is(self, tag: Tag) -> bool {
        self.0.is(tag)
    }

    #[hot]
    pub(crate) fn is_heap(self) -> bool {
        self.tag().byte() & Tag::HEAP_BIT != 0
    }

    /// Returns true if a read from a table may have to bind it.
    #[hot]
    pub(crate) fn may_use_self(self) -> bool {
        matches!(self.tag(), Tag::FUNCTION | Tag::CLOSURE | Tag::BOUND)
    }

    /// Returns true if it is an integer or a float.
    #[hot]
    pub(crate) fn is_number(self) -> bool {
        matches!(self.tag(), Tag::INT | Tag::FLOAT)
    }

    /// Returns true if it is nil.
    #[hot]
    pub fn is_nil(self) -> bool {
        self.is(Tag::NIL)
    }

    /// Returns true if a condition with this value is false: nil and integer 0 are false, all other
    /// values are true.
    #[hot]
    pub fn is_false(self) -> bool {
        self.tag().byte() & !FALSE_BIT == Tag::NIL.byte() && P::is_zero(self.raw())
    }

    /// Returns the integer, if it is one.
    #[hot]
    pub fn as_int(self) -> Option<i32> {
        if self.is(Tag::INT) { Some(P::int_to_i32(self.raw())) } else { None }
    }

    /// Returns the exact value of a number.
    #[one_copy]
    pub(crate) fn unpack(self) -> Float<P> {
        if self.is(Tag::INT) { Float::from_int(self.raw()) } else { P::unpack(self.raw()) }
    }

    /// Returns the value of a number as a float. Integers of the full profile round to the nearest
    /// float, as a float literal would.
    #[inline]
    pub(crate) fn unpack_float(self) -> Float<P> {
        let float = self.unpack();
        if IS_WIDE && self.is(Tag::FLOAT) && !float.is_nan() {
            return float;
        }
        if P::FULL { P::unpack(P::pack(&float)) } else { float }
    }

    /// Returns the number, if it is one.
    #[inline]
    pub fn as_number(self) -> Option<Number> {
        match self.tag() {
            Tag::INT => Some(Number::Int(P::int_to_i32(self.raw()))),
            Tag::FLOAT => Some(Number::Float(P::float_to_f32(self.raw()))),
            _ => None,
        }
    }

    /// Returns the number as a float, if it is one.
    #[inline]
    pub fn as_f32(self) -> Option<f32> {
        match self.tag() {
            Tag::INT => Some(P::int_to_i32(self.raw()) as f32),
            Tag::FLOAT => Some(P::float_to_f32(self.raw())),
            _ => None,
        }
    }

    /// Returns the exact value of a number, for processors that compute with binary64.
    pub(crate) fn as_f64(self) -> f64 {
        if self.is(Tag::INT) {
            f64::from(P::int_to_i32(self.raw()))
        } else {
            f64::from(P::float_to_f32(self.raw()))
        }
    }

    /// Returns the number of a constant string, if it is one.
    #[hot]
    pub fn as_string(self) -> Option<u16> {
        if self.is(Tag::STRING) { Some(self.index() as u16) } else { None }
    }

    /// Returns the type of the value.
    pub fn type_of(self) -> Type {
        match self.tag() {
            Tag::INT => Type::Int,
            Tag::FLOAT => Type::Float,
            Tag::NIL => Type::Nil,
            Tag::STRING | Tag::TEXT => Type::String,
            Tag::TABLE | Tag::LIBRARY | Tag::SNAPSHOT => Type::Table,
            Tag::UNSET => Type::Unset,
            _ => Type::Closure,
        }
    }

    /// Returns the number of the bit in the image's class table that stands for the class of this
    /// value, which must be one that can be sent.
    #[hot]
    pub(crate) fn class_bit(self) -> u8 {
        class_bit(self.tag().byte())
    }

    /// Returns true if tag and payload are equal. This is equality for normalized keys, and
    /// identity for tables and closures.
    #[hot]
    pub(crate) fn same(self, other: Self) -> bool {
        self.0.same(other.0)
    }
}
