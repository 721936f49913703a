//! The range finders VL53L1X: one on the Flow deck or the Z-ranger, which looks down, and five on the
//! Multi-ranger.
//!
//! # Addresses
//! All range finders answer at 0x29 after power-on. The Multi-ranger's are first held in reset; the
//! one that looks down gets another address meanwhile, and then each of the others in turn. A reset
//! of the robot alone does not reach the one that looks down, which keeps its address.
//!
//! # Cost
//! Each range finder measures 30 times per second. A look without a result is one transaction of
//! 0.13 ms on the bus, a result three of 0.8 ms. Six range finders take about 17 % of I2C1, and
//! wake the task about 900 times per second.

use core::cell::Cell;

use bittybuzz_memories::{Deck, DeckSet};
use bittybuzz_vl53l1x::{DEFAULT_ADDRESS, Mode, RangeFault, RangeFinder};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Delay, Duration, Instant, Timer, with_timeout};

use super::expander::Expander;
use super::fault::{DeckFault, DeckFaultCause, DeckSensor, Direction};
use crate::bus::Bus;
use bittybuzz_board::log;

/// The number of directions.
const DIRECTIONS: usize = 6;
/// The direction of each range finder, the pin of the expander that holds it in reset
/// (multiranger.c of crazyflie-firmware), and its address.
const FINDERS: [(Direction, Option<u8>, u8); DIRECTIONS] = [
    (Direction::Down, None, 0x30),
    (Direction::Front, Some(4), 0x31),
    (Direction::Back, Some(1), 0x32),
    (Direction::Left, Some(6), 0x33),
    (Direction::Right, Some(2), 0x34),
    (Direction::Up, Some(0), 0x35),
];
const PINS: u8 = 1 << 0 | 1 << 1 | 1 << 2 | 1 << 4 | 1 << 6;

/// The time after the end of a reset before a range finder answers (2 ms in crazyflie-firmware, the
/// delay of which can be up to 1 ms shorter).
const BOOT: Duration = Duration::from_millis(2);
/// The longest start of a range finder, which takes about 0.1 s.
const START: Duration = Duration::from_millis(1_500);
/// The time between two attempts to start.
const RETRY: Duration = Duration::from_millis(500);
/// The time between two looks.
const LOOK: Duration = Duration::from_millis(5);
/// The time after a result for which there is no next one: a measurement takes 33 ms.
const MEASURING: Duration = Duration::from_millis(28);
/// The longest look, which takes 1 ms.
const LIMIT: Duration = Duration::from_millis(10);
/// The time without a result after which all range finders are started again.
const SILENCE: Duration = Duration::from_millis(300);

/// A measurement.
#[derive(Clone, Copy)]
pub struct RangeSample {
    /// The time of the reading. The measurement began up to 38 ms before.
    pub read_at: Instant,
    /// The distance in meters, or the reason why there is none.
    pub distance_m: Result<f32, RangeFault>,
}

static SAMPLES: Mutex<CriticalSectionRawMutex, Cell<[Option<RangeSample>; DIRECTIONS]>> =
    Mutex::new(Cell::new([None; DIRECTIONS]));
/// The last distance to the floor in m, until the flight task takes it.
pub static FLIGHT_HEIGHT_M: Signal<CriticalSectionRawMutex, f32> = Signal::new();
static REFUSAL: Mutex<CriticalSectionRawMutex, Cell<Option<DeckFault>>> =
    Mutex::new(Cell::new(None));

/// Returns the last measurement in a direction; `None` if there is none yet.
pub fn last_sample(direction: Direction) -> Option<RangeSample> {
    SAMPLES.lock(Cell::get).get(direction as usize).copied().flatten()
}

/// Returns the reason why the range finders are not fit for flight; `None` if there is none.
pub fn refusal() -> Option<DeckFault> {
    REFUSAL.lock(Cell::get)
}

fn refuse(fault: Option<DeckFault>) {
    REFUSAL.lock(|refusal| refusal.set(fault));
}

/// Returns true if a range finder that looks in this direction is on these decks.
pub fn has(decks: DeckSet, direction: Direction) -> bool {
    match direction {
        Direction::Down => decks.has(Deck::Flow2) || decks.has(Deck::ZRanger2),
        _ => decks.has(Deck::MultiRanger),
    }
}

/// Returns the directions of these decks, with pin and address.
fn finders(decks: DeckSet) -> impl Iterator<Item = (Direction, Option<u8>, u8)> {
    FINDERS.into_iter().filter(move |(direction, ..)| has(decks, *direction))
}

/// Refuses to arm until the range finders of these decks run.
pub fn expect(decks: DeckSet) {
    refuse(finders(decks).next().map(|(direction, ..)| DeckFault {
        sensor: DeckSensor::Range(direction),
        cause: DeckFaultCause::NotStarted,
    }));
}

/// A range finder that measures.
struct Running {
    direction: Direction,
    finder: RangeFinder,
    result_at: Instant,
    look_at: Instant,
}

/// Runs the task of the range finders.
#[embassy_executor::task]
pub async fn measure_ranges(mut bus: Bus) -> ! {
    let decks = super::found().await;
    if finders(decks).next().is_none() {
        core::future::pending::<()>().await;
    }
    let mut reported = None;
    loop {
        let fault = match start(&mut bus, decks).await {
            Ok(mut running) => {
                log::info!("range finders run");
                refuse(None);
                reported = None;
                measure(&mut bus, &mut running).await
            }
            Err(fault) => fault,
        };
        refuse(Some(fault));
        // The log has the same fault once.
        if reported != Some(fault) {
            log::error!("{}", fault);
        }
        reported = Some(fault);
        Timer::after(RETRY).await;
    }
}

/// Starts all range finders.
async fn start(
    bus: &mut Bus,
    decks: DeckSet,
) -> Result<heapless::Vec<Running, DIRECTIONS>, DeckFault> {
    let mut expander = None;
    if decks.has(Deck::MultiRanger) {
        let started = with_timeout(LIMIT, Expander::start(bus, PINS)).await;
        let fault = |cause| DeckFault { sensor: DeckSensor::Expander, cause };
        let started = started.map_err(|_| fault(DeckFaultCause::Timeout))?;
        expander = Some(started.map_err(|error| fault(DeckFaultCause::Bus(error)))?);
    }
    let mut running = heapless::Vec::new();
    for (direction, pin, address) in finders(decks) {
        let fault = |cause| DeckFault { sensor: DeckSensor::Range(direction), cause };
        if let (Some(expander), Some(pin)) = (&mut expander, pin) {
            let raised = with_timeout(LIMIT, expander.raise(bus, pin)).await;
            let raised = raised.map_err(|_| fault(DeckFaultCause::Timeout))?;
            raised.map_err(|error| fault(DeckFaultCause::Bus(error)))?;
        }
        Timer::after(BOOT).await;
        let started = with_timeout(START, start_one(bus, address)).await;
        let finder = started.map_err(|_| fault(DeckFaultCause::Timeout))?.map_err(fault)?;
        let now = Instant::now();
        let started = Running { direction, finder, result_at: now, look_at: now };
        // There is a place for each direction.
        let _ = running.push(started);
    }
    Ok(running)
}

/// Starts the range finder that has this address already, or else the one with the address of
/// power-on.
async fn start_one(bus: &mut Bus, address: u8) -> Result<RangeFinder, DeckFaultCause> {
    let mut delay = Delay;
    let moved = RangeFinder::move_chip(bus, &mut delay, DEFAULT_ADDRESS, address).await;
    let finder = match RangeFinder::start(bus, &mut delay, address).await {
        Ok(finder) => finder,
        // The reason why there is no chip at the new address says more.
        Err(error) => return Err(moved.err().unwrap_or(error).into()),
    };
    finder.begin(bus, Mode::Long33Ms).await?;
    Ok(finder)
}

/// Reads and publishes measurements until a range finder gives none.
async fn measure(bus: &mut Bus, running: &mut [Running]) -> DeckFault {
    loop {
        for one in running.iter_mut() {
            let now = Instant::now();
            if now < one.look_at {
                continue;
            }
            one.look_at = now + LOOK;
            // An error has no other effect than a missing result.
            let look = with_timeout(LIMIT, one.finder.poll(bus)).await;
            if let Ok(Ok(Some(reading))) = look {
                (one.result_at, one.look_at) = (now, now + MEASURING);
                let distance_m = reading.distance().map(|distance| distance.meters);
                publish(one.direction, RangeSample { read_at: now, distance_m });
            }
            if now.saturating_duration_since(one.result_at) > SILENCE {
                let sensor = DeckSensor::Range(one.direction);
                return DeckFault { sensor, cause: DeckFaultCause::Silent };
            }
        }
        Timer::after(LOOK).await;
    }
}

fn publish(direction: Direction, sample: RangeSample) {
    if let (Direction::Down, Ok(distance_m)) = (direction, sample.distance_m) {
        FLIGHT_HEIGHT_M.signal(distance_m);
    }
    SAMPLES.lock(|samples| {
        let mut all = samples.get();
        if let Some(slot) = all.get_mut(direction as usize) {
            *slot = Some(sample);
        }
        samples.set(all);
    });
}
