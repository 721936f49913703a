//! The flow sensor PMW3901 of the Flow deck, on SPI1: SCK on PA5, MISO on PA6, MOSI on PA7, and the
//! select line on IO_3, which is PB4.
//!
//! # Cost
//! A reading every 10 ms: two transfers by DMA and four pauses. Each wakes the task, 600 times per
//! second in all. embassy's driver is used, since so few wake-ups cost little: 0.4 % of the core at
//! 1,100 instructions each.

use core::cell::Cell;

use bittybuzz_memories::Deck;
use bittybuzz_pmw3901::{FlowSensor, MotionCounts};
use embassy_stm32::Peri;
use embassy_stm32::dma;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::interrupt::typelevel::{Binding, DMA2_STREAM0, DMA2_STREAM3};
use embassy_stm32::mode::Async;
use embassy_stm32::peripherals::{DMA2_CH0, DMA2_CH3, PA5, PA6, PA7, PB4, SPI1};
use embassy_stm32::spi::{self, Spi, mode::Master};
use embassy_stm32::time::hz;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Delay, Duration, Instant, Ticker, Timer};
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};

use super::fault::{DeckFault, DeckFaultCause, DeckSensor};
use bittybuzz_board::log;

/// 84 MHz / 64, as in crazyflie-firmware.
const CLOCK_HZ: u32 = 1_312_500;
/// The time between two readings.
const PERIOD: Duration = Duration::from_millis(10);
/// The time between two attempts to start.
const RETRY: Duration = Duration::from_millis(500);
/// The bits of the motion byte that are always 1. A line that nothing drives has other bits.
const FIXED_BITS: u8 = 0x30;
/// The number of readings in a row without these bits after which the chip is started again.
const BAD_MAX: u32 = 10;

/// A reading of the flow sensor.
#[derive(Clone, Copy)]
pub struct FlowSample {
    pub read_at: Instant,
    /// The time since the reading before, for which the counts are sums.
    pub duration: Duration,
    pub counts: MotionCounts,
}

static SAMPLE: Mutex<CriticalSectionRawMutex, Cell<Option<FlowSample>>> =
    Mutex::new(Cell::new(None));
/// The last reading, until the flight task takes it.
pub static FLIGHT_SAMPLE: Signal<CriticalSectionRawMutex, FlowSample> = Signal::new();
static REFUSAL: Mutex<CriticalSectionRawMutex, Cell<Option<DeckFault>>> =
    Mutex::new(Cell::new(None));

/// Returns the last reading; `None` if there is none yet.
pub fn last_sample() -> Option<FlowSample> {
    SAMPLE.lock(Cell::get)
}

/// Returns the reason why the flow sensor is not fit for flight; `None` if there is none.
pub fn refusal() -> Option<DeckFault> {
    REFUSAL.lock(Cell::get)
}

/// Refuses to arm for this cause, or no longer.
pub fn refuse(cause: Option<DeckFaultCause>) {
    let fault = cause.map(|cause| DeckFault { sensor: DeckSensor::Flow, cause });
    REFUSAL.lock(|refusal| refusal.set(fault));
}

/// The flow sensor as a device on its bus.
pub struct FlowDevice {
    spi: Spi<'static, Async, Master>,
    select: Output<'static>,
}

impl FlowDevice {
    /// Takes the peripheral and its pins.
    #[expect(clippy::too_many_arguments, reason = "a peripheral, its pins and its streams")]
    pub fn new(
        spi: Peri<'static, SPI1>,
        sck: Peri<'static, PA5>,
        miso: Peri<'static, PA6>,
        mosi: Peri<'static, PA7>,
        select: Peri<'static, PB4>,
        tx: Peri<'static, DMA2_CH3>,
        rx: Peri<'static, DMA2_CH0>,
        irq: impl Binding<DMA2_STREAM3, dma::InterruptHandler<DMA2_CH3>>
        + Binding<DMA2_STREAM0, dma::InterruptHandler<DMA2_CH0>>
        + 'static,
    ) -> Self {
        // The default is mode 0.
        let mut config = spi::Config::default();
        config.frequency = hz(CLOCK_HZ);
        FlowDevice {
            spi: Spi::new(spi, sck, mosi, miso, tx, rx, irq, config),
            select: Output::new(select, Level::High, Speed::Medium),
        }
    }

    async fn perform(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), spi::Error> {
        for operation in operations {
            match operation {
                Operation::Write(bytes) => self.spi.write(bytes).await?,
                Operation::Read(bytes) => self.spi.read(bytes).await?,
                Operation::Transfer(read, written) => self.spi.transfer(read, written).await?,
                Operation::TransferInPlace(bytes) => self.spi.transfer_in_place(bytes).await?,
                Operation::DelayNs(ns) => Timer::after_nanos((*ns).into()).await,
            }
        }
        Ok(())
    }
}

impl ErrorType for FlowDevice {
    type Error = spi::Error;
}

impl SpiDevice for FlowDevice {
    async fn transaction(
        &mut self,
        operations: &mut [Operation<'_, u8>],
    ) -> Result<(), spi::Error> {
        self.select.set_low();
        let outcome = self.perform(operations).await;
        self.select.set_high();
        outcome
    }
}

/// Runs the task of the flow sensor.
#[embassy_executor::task]
pub async fn measure_flow(mut device: FlowDevice) -> ! {
    if !super::found().await.has(Deck::Flow2) {
        core::future::pending::<()>().await;
    }
    let mut reported = None;
    loop {
        let cause = match FlowSensor::start(&mut device, &mut Delay).await {
            Ok(sensor) => {
                log::info!("the flow sensor runs");
                refuse(None);
                reported = None;
                measure(&mut device, &sensor).await
            }
            Err(error) => error.into(),
        };
        refuse(Some(cause));
        // The log has the same fault once.
        if reported != Some(cause) {
            log::error!("{}", DeckFault { sensor: DeckSensor::Flow, cause });
        }
        reported = Some(cause);
        Timer::after(RETRY).await;
    }
}

/// Reads and publishes the motion until the chip no longer answers.
async fn measure(device: &mut FlowDevice, sensor: &FlowSensor) -> DeckFaultCause {
    let mut ticker = Ticker::every(PERIOD);
    let mut before = Instant::now();
    let mut bad = 0;
    while bad < BAD_MAX {
        ticker.next().await;
        match sensor.read(device, &mut Delay).await {
            Ok(counts) if counts.motion & FIXED_BITS == FIXED_BITS => {
                let read_at = Instant::now();
                let duration = read_at.saturating_duration_since(before);
                let sample = FlowSample { read_at, duration, counts };
                SAMPLE.lock(|cell| cell.set(Some(sample)));
                FLIGHT_SAMPLE.signal(sample);
                before = read_at;
                bad = 0;
            }
            _ => bad += 1,
        }
    }
    DeckFaultCause::Silent
}
