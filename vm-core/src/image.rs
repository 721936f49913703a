//! The image of a script, read in place: see `docs/image-format.md`.
//!
//! An [`Image`] is any bytes that claim to be an image. [`Vm::load`](crate::Vm::load) makes it a
//! [`Verified`] one, and only that can be run.

use crate::builtin::{self, Feature};
use crate::bytecode::ByteCode;
use crate::message::STIGMERGIES;
use crate::number::Profile;
use crate::opcode::Operand;
use crate::value::{Tag, Value};

/// First byte of every image.
pub const MAGIC: u8 = 0xb5;
/// The version of format and instruction set.
pub const VERSION: u8 = 2;
/// The bits of the byte `form` that hold the version.
pub const VERSION_BITS: u8 = 0x07;
/// Form byte: the profile is `full`.
pub const FORM_FULL: u8 = 1 << 7;
/// Form byte: there is an order table.
pub const FORM_ORDER: u8 = 1 << 6;
/// Form byte: there is text.
pub const FORM_TEXT: u8 = 1 << 5;
/// Form byte: there is a library table.
pub const FORM_LIBRARIES: u8 = 1 << 4;
/// Form byte: there is a class table.
pub const FORM_CLASSES: u8 = 1 << 3;
/// A row of the class table that accepts every value.
pub const ALL_CLASSES: u8 = 0xff;
/// The number of slots that an image needs in addition to its globals: the machine's own global, an
/// entry's frame and one cell.
pub const BESIDE_GLOBALS: usize = 16;
/// The largest value of a count.
pub const COUNT_MAX: usize = 0x7fff;
/// Function header: it uses `self`.
pub const USES_SELF: u8 = 1 << 7;
/// Function header: it has captured values.
pub const CAPTURES: u8 = 1 << 6;
/// Function header: the bits that count the parameters.
pub const PARAMETERS: u8 = 0x1f;
/// The greatest number of slots of a frame above its record.
pub const DEPTH_MAX: u8 = 200;
/// The number of bytes of the stigmergy table.
const STIGMERGY_TABLE: u16 = 2 * STIGMERGIES;
/// The number of bytes of a row of the library table.
pub(crate) const LIBRARY_ROW: usize = 4;

/// A reason why bytes cannot be run. All variants have the same size, so that the compiler returns
/// an error in registers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum ImageError {
    /// The first byte is not [`MAGIC`].
    NotAnImage,
    /// The image was made for another version of the virtual machine.
    Version(u16),
    /// The image was made for the other number profile.
    Profile,
    /// The image ends in the middle of the header or of a table.
    Truncated,
    /// The image has more than 0xff00 bytes, which is nearly 64 kB.
    TooLong,
    /// The image needs features that this virtual machine lacks: their bits.
    Features(u16),
    /// An entry names no function and no global.
    Entry(u16),
    /// The robot has no function with this name hash.
    RobotFunction(u16),
    /// The globals alone fill the arena.
    TooManyGlobals(u16),
    /// A row of the library table is wrong: its number, from 0.
    LibraryTable(u16),
    /// The header or the offset of a function is wrong.
    Function(u16),
    /// An instruction is unknown, incomplete or runs over its function's end.
    Instruction(u16),
    /// An operand or trailer names something that does not exist.
    Operand(u16),
    /// The operand stack would run empty, exceed the declared depth, or differ in depth between two
    /// paths.
    Depth(u16),
    /// A jump leads to a position that is no valid target.
    Jump(u16),
    /// A function's code runs over its end.
    NoReturn(u16),
    /// The function has more jumps than the verifier's memory, the empty arena, can follow.
    TooManyJumps(u16),
    /// The image is not sealed for this robot, or was changed after sealing.
    Seal,
}

impl ImageError {
    /// Returns the cause and its value as two numbers, for a link to the host.
    pub const fn to_code(self) -> (u8, u16) {
        match self {
            ImageError::NotAnImage => (0, 0),
            ImageError::Version(version) => (1, version),
            ImageError::Profile => (2, 0),
            ImageError::Truncated => (3, 0),
            ImageError::TooLong => (4, 0),
            ImageError::Features(bits) => (5, bits),
            ImageError::Entry(number) => (6, number),
            ImageError::RobotFunction(hash) => (7, hash),
            ImageError::TooManyGlobals(count) => (8, count),
            ImageError::LibraryTable(row) => (9, row),
            ImageError::Function(at) => (10, at),
            ImageError::Instruction(at) => (11, at),
            ImageError::Operand(at) => (12, at),
            ImageError::Depth(at) => (13, at),
            ImageError::Jump(at) => (14, at),
            ImageError::NoReturn(at) => (15, at),
            ImageError::TooManyJumps(at) => (16, at),
            ImageError::Seal => (17, 0),
        }
    }

    /// Restores an error from its two numbers.
    pub const fn from_code(cause: u8, value: u16) -> Option<Self> {
        Some(match cause {
            0 => ImageError::NotAnImage,
            1 => ImageError::Version(value),
            2 => ImageError::Profile,
            3 => ImageError::Truncated,
            4 => ImageError::TooLong,
            5 => ImageError::Features(value),
            6 => ImageError::Entry(value),
            7 => ImageError::RobotFunction(value),
            8 => ImageError::TooManyGlobals(value),
            9 => ImageError::LibraryTable(value),
            10 => ImageError::Function(value),
            11 => ImageError::Instruction(value),
            12 => ImageError::Operand(value),
            13 => ImageError::Depth(value),
            14 => ImageError::Jump(value),
            15 => ImageError::NoReturn(value),
            16 => ImageError::TooManyJumps(value),
            17 => ImageError::Seal,
            _ => return None,
        })
    }
}

/// A function that the host calls.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Entry {
    /// The global code, once.
    Global,
    /// `init()`, once.
    Init,
    /// `step()`, ten times a second.
    Step,
    /// `reset()`, when the host asks.
    Reset,
    /// `destroy()`, when the host asks.
    Destroy,
}

/// The function of an entry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EntryPoint {
    /// The script does not have this entry.
    None,
    /// A function that never changes.
    Function(u16),
    /// The value that this global holds at the time of the call.
    Global(u16),
}

impl EntryPoint {
    /// Decodes the count in the header.
    pub const fn from_count(count: u16) -> Self {
        match count {
            n if n % 2 == 1 => EntryPoint::Function(n / 2),
            0 => EntryPoint::None,
            n => EntryPoint::Global(n / 2 - 1),
        }
    }

    /// Returns the count in the header.
    pub const fn to_count(self) -> u16 {
        match self {
            EntryPoint::None => 0,
            EntryPoint::Function(number) => 2 * number + 1,
            EntryPoint::Global(number) => 2 * number + 2,
        }
    }
}

/// Bytes that may be an image.
#[derive(Debug, Clone, Copy)]
pub struct Image<C: ByteCode> {
    pub(crate) code: C,
}

impl<C: ByteCode> Image<C> {
    /// Takes any bytes; they are checked when a machine loads them.
    pub fn new(code: C) -> Self {
        Image { code }
    }

    /// Reads the header, without any check of the code.
    pub fn header(&self) -> Result<ImageHeader, ImageError> {
        let mut header = ImageHeader::EMPTY;
        header.read(&self.code)?;
        Ok(header)
    }
}

/// The length of the longest image in bytes.
const LENGTH_MAX: usize = 0xff00;
/// The number of bytes before the counts.
const FIXED: usize = 7;
/// The number of counts that every image has.
const COUNTS: usize = 8;
/// The number of entries, whose counts come first.
const ENTRIES: usize = 4;

/// The offsets of an image's parts, in bytes from its start, and their counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageHeader {
    /// Magic, form, features and script hash.
    fixed: [u8; FIXED],
    /// The counts of the entries `init`, `step`, `reset`, `destroy`, and of globals, functions,
    /// imports and strings; then the numbers below, which follow from them. An array, because
    /// reading it takes a fraction of the code.
    counts: [u16; WORDS],
}

// Indices of the other numbers in the array.
const LIBRARY_ROWS: usize = COUNTS;
const IMPORTS_AT: usize = COUNTS + 1;
const ORDER_AT: usize = COUNTS + 2;
const LIBRARIES_AT: usize = COUNTS + 3;
const FUNCTIONS_AT: usize = COUNTS + 4;
const CODE_AT: usize = COUNTS + 5;
/// The length of the array.
pub(crate) const WORDS: usize = COUNTS + 6;

impl ImageHeader {
    /// Returns the form byte.
    pub fn form(&self) -> u8 {
        self.fixed[1]
    }

    /// Returns the feature bits.
    pub fn features(&self) -> u8 {
        self.fixed[2]
    }

    /// Returns the script hash.
    pub fn hash(&self) -> u32 {
        let [_, _, _, hash @ ..] = self.fixed;
        u32::from_le_bytes(hash)
    }

    /// Returns the counts of the entries `init`, `step`, `reset`, `destroy`.
    pub fn entries(&self) -> impl Iterator<Item = u16> {
        self.counts.iter().take(ENTRIES).copied()
    }

    /// Returns the number of things that an operand of a kind from [`Operand::Global`] to
    /// [`Operand::String`] can name. For strings these are the strings of the script only.
    pub(crate) fn count(&self, operand: u8) -> u16 {
        self.counts[usize::from(operand) % COUNTS]
    }

    /// Returns the number of rows of the library table.
    #[inline]
    pub fn library_rows(&self) -> u16 {
        self.counts[LIBRARY_ROWS]
    }

    /// Returns the offset of the imports; the tables follow them.
    #[inline]
    pub fn imports_at(&self) -> u16 {
        self.counts[IMPORTS_AT]
    }

    /// Returns the offset of the order table.
    #[inline]
    fn order_at(&self) -> u16 {
        self.counts[ORDER_AT]
    }

    /// Returns the offset of the first row of the library table.
    #[inline]
    pub fn libraries_at(&self) -> u16 {
        self.counts[LIBRARIES_AT]
    }

    /// Returns the offset of the function table.
    #[inline]
    pub fn functions_at(&self) -> u16 {
        self.counts[FUNCTIONS_AT]
    }

    /// Returns the offset of the code.
    #[inline]
    pub fn code_at(&self) -> u16 {
        self.counts[CODE_AT]
    }

    /// Returns the numbers of the header, as a [`SealedImage`](crate::seal::SealedImage) image stores them.
    pub(crate) fn words(&self) -> [u16; WORDS] {
        self.counts
    }

    /// Returns true if stigmergies have other numbers in messages than in the script.
    pub fn has_stigmergy_table(&self) -> bool {
        self.features() & Feature::StigmergyTable as u8 != 0
    }

    /// Returns the offset of the stigmergy table, which ends at the start of the imports; `None` if
    /// there is none.
    pub fn stigmergies_at(&self) -> Option<u16> {
        let at = self.imports_at().wrapping_sub(STIGMERGY_TABLE);
        if self.has_stigmergy_table() { Some(at) } else { None }
    }

    /// Returns the number of globals.
    pub fn globals(&self) -> u16 {
        self.count(Operand::Global as u8)
    }

    /// Returns the number of functions.
    pub fn functions(&self) -> u16 {
        self.count(Operand::Function as u8)
    }

    /// Returns the number of imported robot functions.
    pub fn imports(&self) -> u16 {
        self.count(Operand::Robot as u8)
    }

    /// Returns the number of strings of the script.
    pub fn strings(&self) -> u16 {
        self.count(Operand::String as u8)
    }

    /// Returns true if the image is for the `full` profile.
    pub fn is_full(&self) -> bool {
        self.form() & FORM_FULL != 0
    }

    /// Returns true if strings of the script can be ordered with the machine's own.
    pub fn has_order(&self) -> bool {
        self.form() & FORM_ORDER != 0
    }

    /// Returns true if the image has texts, which strings made at run time need.
    pub fn has_text(&self) -> bool {
        self.form() & FORM_TEXT != 0
    }

    /// Returns the offset of the class table, which ends at the start of the function table; `None`
    /// if there is none.
    pub fn classes_at(&self) -> Option<u16> {
        let length = self.strings() + 1;
        if self.form() & FORM_CLASSES != 0 { Some(self.functions_at() - length) } else { None }
    }

    /// Returns the offset of the text.
    pub fn text_at(&self) -> u16 {
        self.functions_at() + 2 * self.functions()
    }

    /// Returns true if values may name strings, robot functions or functions of this image that `known`
    /// does not have, whose functions are the first of this one. The first function after them has no
    /// name.
    pub fn names_more_than(&self, known: &Self) -> bool {
        self.functions() > known.functions() + 1
            || self.strings() != known.strings()
            || self.imports() != known.imports()
    }

    /// Returns the function of an entry.
    pub fn entry(&self, entry: Entry) -> EntryPoint {
        let [init, step, reset, destroy, ..] = self.counts;
        EntryPoint::from_count(match entry {
            Entry::Global => const { EntryPoint::Function(0).to_count() },
            Entry::Init => init,
            Entry::Step => step,
            Entry::Reset => reset,
            Entry::Destroy => destroy,
        })
    }
}

/// Reading: one part after the other, where `at` is the offset of the next part. Parts may lie
/// after the end, where bytes are arbitrary. One check after all reads finds that, and takes much
/// less code than a check for each part.
impl ImageHeader {
    /// A header before anything was read.
    pub(crate) const EMPTY: Self = ImageHeader { fixed: [0; FIXED], counts: [0; WORDS] };

    #[one_copy]
    pub(crate) fn read<C: ByteCode>(&mut self, code: &C) -> Result<(), ImageError> {
        // A previous program must leave nothing here, not even a count that this image does not
        // have.
        self.counts[LIBRARY_ROWS] = 0;
        let length = code.len();
        // The last positions of 16 bits are return positions that stand for the machine itself.
        if length > LENGTH_MAX {
            return Err(ImageError::TooLong);
        }
        self.read_fixed(code);
        let [magic, form, ..] = self.fixed;
        if length > 0 && magic != MAGIC {
            return Err(ImageError::NotAnImage);
        }
        if length > 1 && form & VERSION_BITS != VERSION {
            return Err(ImageError::Version(u16::from(form & VERSION_BITS)));
        }
        let mut at = FIXED as u16;
        for place in self.counts.iter_mut().take(COUNTS) {
            (at, *place) = count(code, at);
        }
        if self.has_stigmergy_table() {
            at = skip(at, STIGMERGY_TABLE);
        }
        // A count has 15 bits, so twice a count has 16.
        self.counts[IMPORTS_AT] = at;
        at = skip(at, 2 * self.imports());
        self.counts[ORDER_AT] = at;
        if form & FORM_ORDER != 0 {
            at = skip(at, self.strings());
        }
        if form & FORM_LIBRARIES != 0 && usize::from(at) <= length {
            (at, self.counts[LIBRARY_ROWS]) = count(code, at);
        }
        self.counts[LIBRARIES_AT] = at;
        at = skip(at, 2 * self.library_rows());
        at = skip(at, 2 * self.library_rows());
        if form & FORM_CLASSES != 0 {
            at = skip(at, self.strings() + 1);
        }
        self.counts[FUNCTIONS_AT] = at;
        at = skip(at, 2 * self.functions());
        if form & FORM_TEXT != 0 {
            let mut strings = self.strings();
            while strings > 0 && usize::from(at) <= length {
                strings -= 1;
                let length;
                (at, length) = count(code, at);
                at = skip(at, length);
            }
        }
        self.counts[CODE_AT] = at;
        if usize::from(at) > length {
            return Err(ImageError::Truncated);
        }
        Ok(())
    }

    fn read_fixed<C: ByteCode>(&mut self, code: &C) {
        for (at, byte) in self.fixed.iter_mut().enumerate() {
            *byte = code.byte(at);
        }
    }

    /// Reads a header whose numbers are stored at offset `at`.
    #[inline]
    pub(crate) fn read_words<C: ByteCode>(&mut self, code: &C, at: usize) {
        self.read_fixed(code);
        for (number, word) in self.counts.iter_mut().enumerate() {
            *word = code.word(at + 2 * number);
        }
    }
}

/// An image that the verifier has accepted: every instruction, operand and jump in it is sound, so
/// it can neither panic the machine nor leave its memory. Only the verifier makes one, here or
/// where the image was [sealed](crate::seal).
#[derive(Debug, Clone, Copy)]
pub struct Verified<'a, C: ByteCode> {
    pub(crate) code: C,
    pub(crate) header: &'a ImageHeader,
}

impl<'a, C: ByteCode> Verified<'a, C> {
    /// Returns its header.
    pub fn header(self) -> &'a ImageHeader {
        self.header
    }

    /// Returns the offset of a function's header in the image.
    #[hot]
    pub(crate) fn function(self, number: u16) -> usize {
        let row = usize::from(self.header.functions_at()) + 2 * usize::from(number);
        usize::from(self.code.word(row)) + usize::from(self.header.code_at())
    }

    /// Returns the name hash of an imported robot function.
    #[hot]
    pub(crate) fn import(self, number: u16) -> u16 {
        self.code.word(usize::from(self.header.imports_at()) + 2 * usize::from(number))
    }

    /// Returns the offset of the header of the function that contains an offset of the image.
    pub(crate) fn function_at(self, at: usize) -> usize {
        // Functions stand one after the other, in the order of their numbers.
        let (mut number, mut end) = (0, self.header.functions());
        while end.wrapping_sub(number) > 1 {
            let middle = number + (end - number) / 2;
            if self.function(middle) <= at {
                number = middle;
            } else {
                end = middle;
            }
        }
        self.function(number)
    }

    /// Returns the number of a stigmergy in messages from its number in the script, or the other
    /// way round: a number in the stigmergy table changes places with its position there.
    pub(crate) fn other_stigmergy_number(self, number: u16) -> u16 {
        if !self.header.has_stigmergy_table() {
            return number;
        }
        // The table ends at the start of the imports.
        let mut at = usize::from(self.header.imports_at());
        let mut place = STIGMERGIES as u8;
        while place != 0 {
            place -= 1;
            at = at.wrapping_sub(2);
            let listed = self.code.word(at);
            if u16::from(place) == number {
                return listed;
            }
            if listed == number {
                return place.into();
            }
        }
        number
    }

    /// Returns the built-in that a name of a library stands for.
    pub(crate) fn library_member(self, library: u8, string: u16) -> Option<u8> {
        let rows = (0..self.header.library_rows()).map(move |row| self.library_row(row));
        rows.filter(|row| row.0 == library && row.1 == string).map(|row| row.2).next()
    }

    /// Returns library, string and built-in of a row of the library table.
    pub(crate) fn library_row(self, row: u16) -> (u8, u16, u8) {
        let at = usize::from(self.header.libraries_at()) + LIBRARY_ROW * usize::from(row);
        (self.code.byte(at), self.code.word(at + 1), self.code.byte(at + 3))
    }

    /// Returns the classes of values that the script may send on a topic or under a key.
    #[hot]
    pub(crate) fn classes<P: Profile>(self, name: Value<P>) -> u8 {
        // Numbers, and strings made at run time, share one row, which comes first.
        let mut row = self.header.strings();
        if name.is(Tag::STRING) {
            row = name.index() as u16;
            if row < builtin::string::COUNT {
                return ALL_CLASSES;
            }
            row -= builtin::string::COUNT;
        }
        // The rows are in descending order of the strings, which saves an addition here.
        self.code.byte(usize::from(self.header.functions_at().wrapping_sub(1).wrapping_sub(row)))
    }

    /// Returns the number of the machine's own strings that sort before this string of the script.
    pub(crate) fn string_order(self, number: u16) -> u8 {
        let index = number.wrapping_sub(builtin::string::COUNT);
        self.code.byte(usize::from(self.header.order_at()) + usize::from(index))
    }
}

/// Returns the position after a count, and the count.
#[one_copy]
fn count<C: ByteCode>(code: &C, at: u16) -> (u16, u16) {
    let first = code.byte(at.into());
    if first < 0x80 {
        return (at + 1, u16::from(first));
    }
    let low = code.byte(usize::from(at) + 1);
    (at + 2, u16::from(first & 0x7f) << 8 | u16::from(low))
}

/// Returns the position after that number of bytes, or the last position that 16 bits can hold.
#[one_copy]
fn skip(at: u16, bytes: u16) -> u16 {
    at.saturating_add(bytes)
}
