//! Values that do not fit a frame: their way from the heap to the content of a long message, and
//! back. The queues of the link cut contents into fragments, and join them again.
//!
//! Nested tables are walked without recursion: the state of each outer table lies on the machine's
//! stack.

use super::protocol::Count;
use crate::arena::CELL;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::heap::{VISIT, Visit};
use crate::host::Host;
use crate::image::CAPTURES;
use crate::machine::Vm;
use crate::message::content::{self, ContentItem, ContentReader, ContentWriter, Head};
use crate::message::{self, STIGMERGIES};
use crate::network::Buffer;
use crate::number::Profile;
use crate::number::wide::IS_WIDE;
use crate::part::Part;
use crate::value::{Tag, Value};

// Slots of the state of a table that is being read.
const TABLE: usize = 0;
const LEFT: usize = 1;
/// Unset until the key is read.
const KEY: usize = 2;
const ELEMENT: usize = 3;
const READING: usize = 4;

/// The number of slots of the state of a table that is being written: the visit, and the place in
/// the content of the number of pairs.
const VISITED: usize = VISIT + 1;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the value as an entry of a stigmergy keeps it, and the digest of key and value. A
    /// table is copied, so that later changes to it do not change the entry. Fails if the value
    /// cannot be sent. Key and value must be on the stack.
    pub(super) fn sendable(
        &mut self,
        stigmergy: u8,
        key: Value<P>,
        value: Value<P>,
    ) -> Result<(Value<P>, u16), Stopped> {
        let digest = self.digest_of(stigmergy, key, value)?;
        Ok((self.copied(value)?, digest))
    }

    /// Returns the digest of key and value of an entry, 0 if it fits a frame. Fails if the value
    /// cannot be sent. Key and value must be on the stack or in an entry.
    #[one_copy]
    pub(super) fn digest_of(
        &mut self,
        stigmergy: u8,
        key: Value<P>,
        value: Value<P>,
    ) -> Result<u16, Stopped> {
        let number = self.number_of_stigmergy(stigmergy);
        let has_frame = number < STIGMERGIES && matches!(key.tag(), Tag::INT | Tag::STRING);
        if has_frame && value.is_plain() {
            return Ok(0);
        }
        if !Self::has(Part::LongMessages) {
            return Err(self.fail_on(FaultCode::NotSendable, key, value));
        }
        let mut content = P::Content::ZERO;
        let head = Head::Entry { stigmergy: number, owner: 0, clock: 0, digest: 0 };
        let length = self.write(head, key, value, content.as_mut())?.length();
        Ok(content::digest(content.as_ref().get(..length).unwrap_or(&[])))
    }

    /// Copies the tables in a value of an entry, so that a script which changes the copy does not
    /// change the entry. The value must be on the stack or in an entry.
    #[hot]
    pub(super) fn copied(&mut self, value: Value<P>) -> Result<Value<P>, Stopped> {
        if Self::has(Part::LongMessages) && is_table(value) {
            self.copy_tables(value)
        } else {
            Ok(value)
        }
    }

    #[one_copy]
    fn copy_tables(&mut self, value: Value<P>) -> Result<Value<P>, Stopped> {
        let base = usize::from(self.sp);
        self.reserve(2)?;
        let copy = self.allocate(|vm| vm.arena.copy_table(value.index()))?;
        // The first slot keeps the copy reachable for a collection. The slots above it hold copies
        // whose inner tables are still shared with the entry.
        self.arena.set(base, copy);
        self.arena.set(base + 1, copy);
        while usize::from(self.sp) != base + 1 {
            let table = self.pop();
            let mut visit = self.arena.visit(table.index());
            while let Some([_, inner]) = self.arena.next_stored(&mut visit) {
                if is_table(inner) {
                    self.reserve(1)?;
                    let copy = self.allocate(|vm| vm.arena.copy_table(inner.index()))?;
                    self.arena.set(visit.slot(), copy);
                    self.set_top(copy);
                }
            }
        }
        self.sp = base as u16;
        Ok(copy)
    }

    /// Sends a topic or key with a value that does not fit a frame. Returns false if the host has no
    /// room for it.
    #[one_copy]
    pub(super) fn send_long<H: Host<P>>(
        &mut self,
        host: &mut H,
        head: Head,
        first: Value<P>,
        value: Value<P>,
    ) -> Result<bool, Stopped> {
        let mut content = P::Content::ZERO;
        let writer = self.write(head, first, value, content.as_mut())?;
        let length = writer.finish().unwrap_or(0);
        let content = content.as_ref().get(..length).unwrap_or(&[]);
        let is_sent = host.send_content(self.robot_id, content);
        if is_sent {
            self.protocol.silent = 0;
        }
        Ok(is_sent)
    }

    /// Writes the content of a message, without its check. Fails if there is no room for it.
    fn write<'r>(
        &mut self,
        head: Head,
        first: Value<P>,
        second: Value<P>,
        room: &'r mut [u8],
    ) -> Result<ContentWriter<'r>, Stopped> {
        let mut writer = ContentWriter::new(room, self.script(), head);
        self.write_value(&mut writer, first)?;
        self.write_value(&mut writer, second)?;
        Ok(writer)
    }

    fn write_value(
        &mut self,
        writer: &mut ContentWriter<'_>,
        value: Value<P>,
    ) -> Result<(), Stopped> {
        let base = usize::from(self.sp);
        let mut visit = Visit::NONE;
        // The place in the content of the table's number of pairs.
        let mut place = 0;
        // A table that repeats, or that contains itself, is visited again. Its free places need no
        // room in the content, but time, so all visits together may see as many places as the
        // memory has. The places of a visit are taken off when it leaves its table, and given back
        // when it returns.
        let mut places = SLOTS;
        let mut value = value;
        loop {
            self.write_item(writer, value)?;
            if !writer.fits() {
                return Err(self.fail(FaultCode::TooLong));
            }
            if is_table(value) {
                places = self.leave(places, &visit)?;
                // The visit to the table around it continues afterwards.
                self.reserve(VISITED)?;
                let at = usize::from(self.sp) - VISITED;
                let [slot, end, rest, index] = visit.parts();
                for (at, part) in (at..).zip([slot, end, rest, index, place]) {
                    self.arena.set(at, Value::indexed(Tag::INT, part));
                }
                visit = self.arena.visit(value.index());
                place = writer.length() as u16 - 1;
            }
            // Find the next value of the innermost table that has one.
            loop {
                if usize::from(self.sp) == base {
                    return Ok(());
                }
                if let Some([key, next]) = self.arena.next_stored(&mut visit) {
                    // A content that fits has far fewer than 256 pairs.
                    writer.increment(place.into());
                    self.write_item(writer, key)?;
                    value = next;
                    break;
                }
                places = self.leave(places, &visit)?;
                let at = usize::from(self.sp) - VISITED;
                let [slot, end, rest, index, place_around] =
                    [0, 1, 2, 3, 4].map(|part| self.arena.index_at(at + part) as u16);
                visit = Visit::of([slot, end, rest, index]);
                places += usize::from(index);
                place = place_around;
                self.sp = at as u16;
            }
        }
    }

    /// Returns the number of places that may still be seen after a visit has left its table.
    fn leave(&mut self, places: usize, visit: &Visit) -> Result<usize, Stopped> {
        let seen = usize::from(visit.places());
        places.checked_sub(seen).ok_or_else(|| self.fail(FaultCode::TooLong))
    }

    /// Writes a value. For a table it writes only the tag and a number of pairs that is filled in
    /// later.
    fn write_item(
        &mut self,
        writer: &mut ContentWriter<'_>,
        value: Value<P>,
    ) -> Result<(), Stopped> {
        let item = match value.tag() {
            Tag::NIL | Tag::INT | Tag::FLOAT | Tag::STRING => ContentItem::Plain(value),
            Tag::FUNCTION => ContentItem::Function(value.index() as u16),
            Tag::TABLE | Tag::SNAPSHOT => ContentItem::Table(0),
            Tag::TEXT if P::FULL => match u8::try_from(self.view().text_length(value)) {
                Ok(length) => ContentItem::Text(length),
                Err(_) => return Err(self.fail(FaultCode::TooLong)),
            },
            _ => return Err(self.fail_on(FaultCode::NotSendable, value, value)),
        };
        writer.item(item);
        if P::FULL && value.is(Tag::TEXT) {
            self.view().text_bytes(value).for_each(|byte| writer.byte(byte));
        }
        Ok(())
    }

    /// Takes the content of a long message from the host and reads it. An entry is merged. For a
    /// broadcast, leaves topic and value on the stack and returns true.
    #[one_copy]
    pub(super) fn receive_long<H: Host<P>>(&mut self, host: &mut H) -> Result<bool, Stopped> {
        let mut content = P::Content::ZERO;
        let length = host.receive_content(content.as_mut());
        // The queue has not kept the content of an unwanted message.
        if length == 0 {
            return Ok(false);
        }
        let content = content.as_ref().get(..length).unwrap_or(&[]);
        if let Some(head) = self.read_flat(content)? {
            return self.take_message(host, head);
        }
        let (head, reader) = ContentReader::new(content, self.script());
        self.deliver(host, head, reader)
    }

    /// Reads a content; the result is that of [`Vm::receive_long`].
    #[hot]
    fn deliver<H: Host<P>>(
        &mut self,
        host: &mut H,
        head: Head,
        mut reader: ContentReader<'_>,
    ) -> Result<bool, Stopped> {
        if !self.has_room_for(&reader) {
            self.protocol.count(Count::Incomplete);
            return Ok(false);
        }
        self.read(&mut reader)?;
        self.read(&mut reader)?;
        self.take_message(host, head)
    }

    /// Handles a message whose two values are on the stack; the result is that of
    /// [`Vm::receive_long`].
    #[hot]
    fn take_message<H: Host<P>>(&mut self, host: &mut H, head: Head) -> Result<bool, Stopped> {
        let (first, second) = (self.top(2), self.top(1));
        match head {
            Head::Broadcast => Ok(true),
            Head::Entry { stigmergy, owner, clock, digest } => {
                let key = match first.tag() {
                    Tag::INT | Tag::FLOAT | Tag::STRING | Tag::TEXT => first,
                    _ => return Ok(false),
                };
                let mut entry =
                    message::StigmergyEntry { stigmergy, owner, clock, key, value: second };
                self.merge(host, &mut entry, digest)?;
                Ok(false)
            }
        }
    }

    /// Returns true if a content is valid, and its values fit into memory without harm to the
    /// script.
    #[one_copy]
    fn has_room_for(&mut self, reader: &ContentReader<'_>) -> bool {
        let mut slots = 2 * crate::machine::NATIVE_ROOM;
        let mut is_known = true;
        let checked = reader.check::<P>(|item| match item {
            // The head cell has room for two pairs, and each other cell for at least one.
            ContentItem::Table(pairs) => slots += READING + CELL * (1 + usize::from(pairs)),
            ContentItem::Text(length) if P::FULL => slots += CELL * (1 + usize::from(length) / 20),
            // A function that captures values cannot exist without them.
            ContentItem::Function(number) => is_known &= self.head(number) & CAPTURES == 0,
            _ => {}
        });
        if checked.is_err() || !is_known {
            return false;
        }
        if self.arena.unused() < slots {
            self.collect();
        }
        self.arena.unused() >= slots
    }

    /// Reads the next value of a content and pushes it.
    fn read(&mut self, reader: &mut ContentReader<'_>) -> Result<(), Stopped> {
        let result = usize::from(self.sp);
        self.reserve(1)?;
        loop {
            let mut value = match reader.item::<P>() {
                ContentItem::Plain(value) => value,
                ContentItem::Function(number) => Value::indexed(Tag::FUNCTION, number),
                ContentItem::Table(pairs) => {
                    self.reserve(READING)?;
                    let at = usize::from(self.sp) - READING;
                    let table = self.new_table()?;
                    self.arena.set(at + TABLE, table);
                    self.arena.set(at + LEFT, Value::int(i32::from(pairs)));
                    self.arena.set(at + KEY, Value::unset());
                    if pairs != 0 {
                        continue;
                    }
                    self.sp = at as u16;
                    table
                }
                ContentItem::Text(length) if P::FULL => self.read_text(reader, length)?,
                ContentItem::Text(_) => Value::nil(),
            };
            // Store the value in its table, which may be complete with it.
            loop {
                let top = usize::from(self.sp);
                if top == result + 1 {
                    self.arena.set(result, value);
                    return Ok(());
                }
                let at = top - READING;
                let key = self.arena.get(at + KEY);
                if key.is(Tag::UNSET) {
                    self.arena.set(at + KEY, value);
                    break;
                }
                self.arena.set(at + ELEMENT, value);
                if matches!(key.tag(), Tag::INT | Tag::FLOAT | Tag::STRING | Tag::TEXT) {
                    let table = self.arena.get(at + TABLE);
                    let key = self.key(table, key)?;
                    self.table_set(table, key, value)?;
                }
                self.arena.set(at + KEY, Value::unset());
                let left = self.arena.get(at + LEFT).index() as u16 - 1;
                self.arena.set(at + LEFT, Value::int(i32::from(left)));
                if left != 0 {
                    break;
                }
                value = self.arena.get(at + TABLE);
                self.sp = at as u16;
            }
        }
    }
}

/// The most values of a content that [`Vm::read_flat`] reads: topic or key, and a table of four
/// pairs.
const FLAT: usize = 9;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Reads a content in one pass: pushes its two values and returns its head. Returns `None` and
    /// changes nothing if the content is invalid, if it has tables in tables, or if there is no
    /// room for it without a collection.
    fn read_flat(&mut self, content: &[u8]) -> Result<Option<Head>, Stopped> {
        if !IS_WIDE {
            return Ok(None);
        }
        let (head, reader) = ContentReader::new(content, self.script());
        let mut values = [Value::nil(); FLAT];
        let Some((count, has_table)) = reader.plain(&mut values) else { return Ok(None) };
        let pairs = values.get(1..count).unwrap_or(&[]).as_chunks().0;
        let mut slots = 2 * crate::machine::NATIVE_ROOM;
        if has_table {
            slots += READING + CELL * (1 + pairs.len());
        }
        if self.arena.unused() < slots {
            return Ok(None);
        }
        let [first, second, ..] = values;
        self.reserve(1)?;
        self.set_top(first);
        self.reserve(1)?;
        if !has_table {
            self.set_top(second);
            return Ok(Some(head));
        }
        // Plain keys and values refer to no cells, so a collection need not find them.
        self.reserve(READING)?;
        let at = usize::from(self.sp) - READING;
        let table = self.new_table()?;
        self.arena.set(at + TABLE, table);
        if !self.arena.fill_head(table.index(), pairs) {
            for &[mut key, value] in pairs {
                if key.is(Tag::FLOAT) {
                    key = self.key(table, key)?;
                }
                if !key.is_nil() {
                    self.table_set(table, key, value)?;
                }
            }
        }
        self.sp = at as u16;
        self.set_top(table);
        Ok(Some(head))
    }
}

/// Returns true for a table, and for a snapshot, which is a table inside.
fn is_table<P: Profile>(value: Value<P>) -> bool {
    matches!(value.tag(), Tag::TABLE | Tag::SNAPSHOT)
}
