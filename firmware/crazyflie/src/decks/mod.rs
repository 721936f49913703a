//! The decks on the expansion port.
//!
//! Once the radio is set up, the robot reads the memories of the decks. It must not arm with a deck
//! that it does not know: such a deck may drive pins or need a driver. Decks that this firmware
//! works with are the Flow deck v2, the Z-ranger v2 and the Multi-ranger.
//!
//! * [`ranging`] measures distances, [`flow`] the motion of the picture below the robot.
//! * [`expander`] drives the reset lines of the Multi-ranger's range finders.
//! * [`mod@fault`] has the reasons why a deck is not fit for flight.
//!
//! **Not tried on hardware.**

mod expander;
pub mod fault;
pub mod flow;
pub mod ranging;

use core::cell::Cell;

use bittybuzz_board::log;
use bittybuzz_comms::syslink::SyslinkFrame;
use bittybuzz_memories::{
    Deck, DeckConflict, DeckRefusal, DeckScan, DeckSet, MemoryFault, OneWireRequest,
};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;

use bittybuzz_runtime::liveness::BEAT;
use embassy_time::Timer;

use crate::link::one_wire;
use crate::link::send::send_frame;
use fault::{DeckFault, DeckFaultCause};

/// The number of requests in a row without an answer after which the search ends.
const ATTEMPTS: u32 = 10;

static RESULT: Mutex<CriticalSectionRawMutex, Cell<Option<Result<DeckSet, DeckRefusal>>>> =
    Mutex::new(Cell::new(None));

/// Returns the decks of the robot, or the reason why it must not arm; `None` before they are known.
pub fn result() -> Option<Result<DeckSet, DeckRefusal>> {
    RESULT.lock(Cell::get)
}

/// Waits until the decks are known. If the robot must not arm with them, this never ends: their
/// sensors may be others than they seem.
async fn found() -> DeckSet {
    loop {
        if let Some(Ok(decks)) = result() {
            return decks;
        }
        Timer::after(BEAT).await;
    }
}

/// Returns the reason why the sensors of the decks are not fit for flight; `None` if there is none.
pub fn fault() -> Option<DeckFault> {
    ranging::refusal().or_else(flow::refusal)
}

/// Runs the task that looks for decks once.
#[embassy_executor::task]
pub async fn find_decks() {
    one_wire::wait_until_ready().await;
    let mut scan = DeckScan::new();
    let mut attempts = 0;
    while let Some(request) = scan.request() {
        let answer = ask(request).await;
        let is_answered = answer.is_some_and(|answer| {
            let (kind, content) = answer.content();
            scan.process(kind, content)
        });
        attempts = if is_answered { 0 } else { attempts + 1 };
        if attempts == ATTEMPTS {
            scan.give_up();
        }
    }
    let result = scan.result();
    if let Some(Ok(decks)) = result {
        ranging::expect(decks);
        flow::refuse(decks.has(Deck::Flow2).then_some(DeckFaultCause::NotStarted));
    }
    RESULT.lock(|cell| cell.set(result));
    match result {
        Some(Ok(decks)) if decks == DeckSet::default() => log::info!("no decks"),
        Some(Ok(decks)) => decks.iter().for_each(|deck| log::info!("deck {=str}", deck.name())),
        // The lines about arming repeat the reason (readiness.rs).
        Some(Err(refusal)) => log::error!("{}", Shown(refusal)),
        None => {}
    }
}

/// Sends a request, and returns the next answer, which may be that of an earlier request.
async fn ask(request: OneWireRequest) -> Option<one_wire::Answer> {
    let mut buffer = [0; OneWireRequest::BYTES_MAX];
    let (kind, content) = request.write(&mut buffer);
    one_wire::discard_answer();
    if let Ok(frame) = SyslinkFrame::new(kind, content) {
        send_frame(frame);
    }
    one_wire::answer().await
}

/// A refusal in words.
pub struct Shown(pub DeckRefusal);

impl defmt::Format for Shown {
    fn format(&self, f: defmt::Formatter<'_>) {
        match self.0 {
            DeckRefusal::NoAnswer => defmt::write!(f, "the nRF51 does not read memories of decks"),
            DeckRefusal::TooMany(count) => defmt::write!(f, "{=u8} decks are too many", count),
            DeckRefusal::Unreadable { number } => {
                defmt::write!(f, "the memory of deck {=u8} cannot be read", number)
            }
            DeckRefusal::Damaged { number, fault: MemoryFault::NoDescription } => {
                defmt::write!(f, "the memory of deck {=u8} is empty", number)
            }
            DeckRefusal::Damaged { number, fault: MemoryFault::UnknownVersion(version) } => {
                defmt::write!(f, "the memory of deck {=u8} has version {=u8}", number, version)
            }
            DeckRefusal::Damaged { number, .. } => {
                defmt::write!(f, "the memory of deck {=u8} is damaged", number)
            }
            DeckRefusal::Unsupported { vendor, product, name } => defmt::write!(
                f,
                "deck {=str} ({=u8:#x}:{=u8:#x}) is not supported",
                name.as_str(),
                vendor,
                product
            ),
            DeckRefusal::Conflict { first, second, conflict: DeckConflict::Pin(pin) } => {
                defmt::write!(
                    f,
                    "decks {=str} and {=str} drive pin {=u8} of the port",
                    first.name(),
                    second.name(),
                    pin
                )
            }
            DeckRefusal::Conflict { first, second, conflict: DeckConflict::Address(address) } => {
                defmt::write!(
                    f,
                    "decks {=str} and {=str} both use the I2C address {=u8:#x}",
                    first.name(),
                    second.name(),
                    address
                )
            }
        }
    }
}
