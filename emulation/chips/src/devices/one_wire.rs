//! The memories DS28E05 of the decks, which the nRF51 reads over one wire and serves over the link.
//!
//! Sources: deck_memory_format.md and ow_syslink.c of Bitcraze's firmware, memory.c of Bitcraze's
//! nRF51 firmware, and ow_element.py of cflib.
//!
//! The wire itself has no model: answers take no time.

/// The number of bytes of a memory.
pub const CAPACITY: usize = 112;
/// The number of bytes in the answer to a request to read.
const READ_BYTES: usize = 29;

const SCAN: u8 = 0x20;
const GET_INFO: u8 = 0x21;
const READ: u8 = 0x22;
const WRITE: u8 = 0x23;
/// The answer to a request for a memory that does not exist or does not respond.
const FAILED: u8 = 0xff;
/// The answer to a request to write while Bluetooth is on.
const NOT_WRITABLE: u8 = 0xfe;

const HEADER: u8 = 0xeb;
const ELEMENT_NAME: u8 = 1;
const ELEMENT_REVISION: u8 = 2;
/// The one-wire family of the DS28E05.
const FAMILY: u8 = 0x0d;

/// The description of a deck.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeckDescription {
    /// The pins that the deck drives, as bits of the format's table.
    pub used_pins: u32,
    /// The identification of the vendor; Bitcraze is 0xbc.
    pub vendor: u8,
    /// The identification of the product.
    pub product: u8,
    /// Name of the board.
    pub name: String,
    /// Revision of the board.
    pub revision: String,
}

impl DeckDescription {
    /// Returns the description of the Flow deck v2. Name and numbers are those of flowdeck_v1v2.c;
    /// no used pins, as in the example of the format, and the revision are a choice.
    pub fn flow_v2() -> Self {
        DeckDescription::of_bitcraze(0x0f, "bcFlow2")
    }

    /// Returns the description of the Z-ranger deck v2 (zranger2.c).
    pub fn z_ranger_v2() -> Self {
        DeckDescription::of_bitcraze(0x0e, "bcZRanger2")
    }

    /// Returns the description of the Multi-ranger deck (multiranger.c).
    pub fn multi_ranger() -> Self {
        DeckDescription::of_bitcraze(0x0c, "bcMultiranger")
    }

    fn of_bitcraze(product: u8, name: &str) -> Self {
        let (name, revision) = (name.to_string(), "C".to_string());
        DeckDescription { used_pins: 0, vendor: 0xbc, product, name, revision }
    }

    /// Returns the content of the memory, without the bytes after it. Elements that do not fit are
    /// left out.
    fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![HEADER];
        bytes.extend(self.used_pins.to_le_bytes());
        bytes.extend([self.vendor, self.product]);
        bytes.push(crc32(&bytes).to_le_bytes()[0]);
        let begin = bytes.len();
        // The version, and the length of the elements.
        bytes.extend([0, 0]);
        for (id, text) in [(ELEMENT_NAME, &self.name), (ELEMENT_REVISION, &self.revision)] {
            // One byte remains for the checksum.
            if bytes.len() + 2 + text.len() < CAPACITY {
                bytes.extend([id, text.len() as u8]);
                bytes.extend(text.bytes());
            }
        }
        bytes[begin + 1] = (bytes.len() - begin - 2) as u8;
        bytes.push(crc32(&bytes[begin..]).to_le_bytes()[0]);
        bytes
    }
}

/// The memory of a deck.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeckMemory {
    identification: [u8; 8],
    content: [u8; CAPACITY],
}

impl DeckMemory {
    /// Returns an erased memory with this serial number.
    pub fn erased(serial: [u8; 6]) -> Self {
        DeckMemory::with_content(serial, [0xff; CAPACITY])
    }

    /// Returns a memory with this content.
    pub fn with_content(serial: [u8; 6], content: [u8; CAPACITY]) -> Self {
        let mut identification = [0; 8];
        identification[0] = FAMILY;
        identification[1..7].copy_from_slice(&serial);
        identification[7] = crc8(&identification[..7]);
        DeckMemory { identification, content }
    }

    /// Returns the memory of a deck. The bytes after the description are erased.
    pub fn new(serial: [u8; 6], deck: &DeckDescription) -> Self {
        let mut memory = DeckMemory::erased(serial);
        let bytes = deck.to_bytes();
        memory.content[..bytes.len()].copy_from_slice(&bytes);
        memory
    }
}

/// A fault of the memories.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OneWireFault {
    /// The nRF51 does not answer requests.
    NoAnswer,
    /// The nRF51 finds no memory.
    NoMemory,
    /// The nRF51 finds the memories, but cannot read them.
    Unreadable,
    /// The lowest bit of each byte that is read at this location is wrong.
    WrongBit(u16),
}

/// The memories of all decks of a robot.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DeckMemories {
    memories: Vec<DeckMemory>,
    has_bluetooth: bool,
    fault: Option<OneWireFault>,
}

impl DeckMemories {
    /// Returns the memories of these decks, in the order in which the nRF51 finds them.
    pub fn new(memories: Vec<DeckMemory>) -> Self {
        DeckMemories { memories, has_bluetooth: false, fault: None }
    }

    /// Sets the state of Bluetooth in the nRF51. While Bluetooth is on, the nRF51 reads from a copy
    /// and refuses to write.
    pub fn set_bluetooth(&mut self, has_bluetooth: bool) {
        self.has_bluetooth = has_bluetooth;
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<OneWireFault>) {
        self.fault = fault;
    }

    /// Returns the payload of the nRF51's answer to a frame, or `None` if there is no answer.
    ///
    /// # Parameters
    /// `kind`: the type of the frame, 0x20 to 0x23.
    pub fn answer(&mut self, kind: u8, payload: &[u8]) -> Option<Vec<u8>> {
        match self.fault {
            Some(OneWireFault::NoAnswer) => return None,
            Some(OneWireFault::NoMemory) if kind == SCAN => return Some(vec![0]),
            Some(OneWireFault::NoMemory | OneWireFault::Unreadable) if kind != SCAN => {
                return Some(vec![FAILED]);
            }
            _ => {}
        }
        if kind == SCAN {
            return Some(vec![self.memories.len() as u8]);
        }
        let answer = match (kind, payload) {
            (GET_INFO, [number, ..]) => self.information(*number),
            (READ, [number, low, high, ..]) => {
                self.read(*number, u16::from_le_bytes([*low, *high]))
            }
            (WRITE, _) if self.has_bluetooth => Some(vec![NOT_WRITABLE]),
            (WRITE, [number, low, high, length, _, data @ ..]) => {
                let location = u16::from_le_bytes([*low, *high]);
                let data = data.get(..usize::from(*length));
                let is_written = data.and_then(|data| self.write(*number, location, data));
                is_written.map(|()| payload.to_vec())
            }
            (GET_INFO..=WRITE, _) => None,
            _ => return None,
        };
        Some(answer.unwrap_or(vec![FAILED]))
    }

    fn information(&self, number: u8) -> Option<Vec<u8>> {
        let memory = self.memories.get(usize::from(number))?;
        Some([&[number], &memory.identification[..]].concat())
    }

    /// Returns the answer to a request to read, which always has the same length. After the end of
    /// the memory the copy of the nRF51 has zeros, and the wire has ones.
    fn read(&self, number: u8, location: u16) -> Option<Vec<u8>> {
        let memory = self.memories.get(usize::from(number))?;
        let beyond = if self.has_bluetooth { 0x00 } else { 0xff };
        let mut answer = vec![number];
        answer.extend(location.to_le_bytes());
        for location in usize::from(location)..usize::from(location) + READ_BYTES {
            let byte = memory.content.get(location).copied().unwrap_or(beyond);
            let is_wrong = self.fault == Some(OneWireFault::WrongBit(location as u16));
            answer.push(byte ^ u8::from(is_wrong));
        }
        Some(answer)
    }

    fn write(&mut self, number: u8, location: u16, data: &[u8]) -> Option<()> {
        let memory = self.memories.get_mut(usize::from(number))?;
        let begin = usize::from(location);
        memory.content.get_mut(begin..begin + data.len())?.copy_from_slice(data);
        Some(())
    }
}

/// Returns the CRC-32 of Ethernet.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |crc: u32, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| {
            crc >> 1 ^ if crc & 1 != 0 { 0xedb8_8320 } else { 0 }
        })
    })
}

/// Returns the CRC-8 of one-wire serial numbers (Maxim's application note 27).
fn crc8(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |crc: u8, byte| {
        (0..8).fold(crc ^ *byte, |crc, _| crc >> 1 ^ if crc & 1 != 0 { 0x8c } else { 0 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SERIAL: [u8; 6] = [1, 2, 3, 4, 5, 6];

    fn decks() -> DeckMemories {
        let decks = [DeckDescription::flow_v2(), DeckDescription::multi_ranger()];
        DeckMemories::new(decks.iter().map(|deck| DeckMemory::new(SERIAL, deck)).collect())
    }

    /// Reads a memory as Bitcraze's firmware does (ow_syslink.c).
    fn read(decks: &mut DeckMemories, number: u8) -> Option<Vec<u8>> {
        let mut found = Vec::new();
        while found.len() < CAPACITY {
            let length = READ_BYTES.min(CAPACITY - found.len());
            let mut request = vec![number, found.len() as u8, 0];
            request.resize(3 + length, 0);
            let answer = decks.answer(READ, &request)?;
            found.extend(answer.get(3..3 + length)?);
        }
        Some(found)
    }

    /// The bytes that cflib 0.1.34 writes for three decks. From byte 8 on the first are the example
    /// of deck_memory_format.md; byte 7 there is 0x44, which the firmware would refuse.
    #[test]
    fn contents_are_those_of_other_programs() {
        let led_ring = DeckDescription {
            used_pins: 0,
            vendor: 0xbc,
            product: 1,
            name: "bcLedRing".to_string(),
            revision: "b".to_string(),
        };
        let cases = [
            (led_ring, "eb00000000bc01b1000e010962634c656452696e6702016255"),
            (DeckDescription::flow_v2(), "eb00000000bc0fb6000c01076263466c6f773202014378"),
            (
                DeckDescription::multi_ranger(),
                "eb00000000bc0c0c0012010d62634d756c746972616e67657202014387",
            ),
        ];
        for (deck, expected) in cases {
            let found: String = deck.to_bytes().iter().map(|byte| format!("{byte:02x}")).collect();
            assert_eq!(found, expected);
        }
    }

    /// The check values of both algorithms for the digits 1 to 9; the first is in crc32.c of
    /// Bitcraze's firmware, the second in the catalog of CRCs as CRC-8/MAXIM-DOW.
    #[test]
    fn checksums_have_their_check_values() {
        assert_eq!((crc32(b"123456789"), crc8(b"123456789")), (0xcbf4_3926, 0xa1));
    }

    #[test]
    fn the_firmware_finds_and_reads_the_decks() {
        let mut decks = decks();
        assert_eq!(decks.answer(SCAN, &[]), Some(vec![2]));
        let information = decks.answer(GET_INFO, &[1]).unwrap();
        assert_eq!(information[..8], [1, 0x0d, 1, 2, 3, 4, 5, 6]);
        assert_eq!(crc8(&information[1..]), 0);
        for (number, deck) in
            [DeckDescription::flow_v2(), DeckDescription::multi_ranger()].into_iter().enumerate()
        {
            let found = read(&mut decks, number as u8).unwrap();
            let expected = deck.to_bytes();
            assert_eq!(found[..expected.len()], expected);
            assert!(found[expected.len()..].iter().all(|byte| *byte == 0xff));
        }
        // A memory that does not exist: one byte 0xff (memory.c of the nRF51 firmware).
        assert_eq!(decks.answer(GET_INFO, &[2]), Some(vec![0xff]));
        assert_eq!(decks.answer(READ, &[2, 0, 0]), Some(vec![0xff]));
        // The answer has 29 bytes, also at the end of the memory.
        assert_eq!(decks.answer(READ, &[0, 110, 0]).unwrap()[3..], [0xff; 29]);
        decks.set_bluetooth(true);
        let beyond = decks.answer(READ, &[0, 110, 0]).unwrap();
        assert_eq!((&beyond[..5], &beyond[5..]), (&[0, 110, 0, 0xff, 0xff][..], &[0; 27][..]));
    }

    #[test]
    fn memories_are_written_while_bluetooth_is_off() {
        let mut decks = decks();
        let request = [0, 60, 0, 4, 0, 7, 8, 9, 10];
        assert_eq!(decks.answer(WRITE, &request), Some(request.to_vec()));
        assert_eq!(read(&mut decks, 0).unwrap()[59..65], [0xff, 7, 8, 9, 10, 0xff]);
        assert_eq!(decks.answer(WRITE, &[0, 110, 0, 4, 0, 7, 8, 9, 10]), Some(vec![0xff]));
        decks.set_bluetooth(true);
        assert_eq!(decks.answer(WRITE, &request), Some(vec![0xfe]));
    }

    #[test]
    fn faults_change_the_answers() {
        let mut decks = decks();
        decks.set_fault(Some(OneWireFault::NoAnswer));
        assert_eq!(decks.answer(SCAN, &[]), None);
        decks.set_fault(Some(OneWireFault::NoMemory));
        assert_eq!(decks.answer(SCAN, &[]), Some(vec![0]));
        decks.set_fault(Some(OneWireFault::Unreadable));
        assert_eq!(decks.answer(SCAN, &[]), Some(vec![2]));
        assert_eq!(read(&mut decks, 0), None);
        decks.set_fault(Some(OneWireFault::WrongBit(6)));
        assert_eq!(read(&mut decks, 0).unwrap()[6], 0x0f ^ 1);
    }
}
