//! Loads an image and runs its entries. The program is only linked to measure it, and is never
//! started.
//!
//! The panic handler calls a function that does not exist, so that the program only links if it
//! contains no panic.

#![no_std]
#![no_main]

#[cfg(feature = "full")]
use bittybuzz_vm_core::number::Full as Numbers;
#[cfg(not(feature = "full"))]
use bittybuzz_vm_core::number::Tiny as Numbers;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Entry, Host, Image, Part, Parts, Reply, RobotFault, Sighting,
    Sizes, Value, Vm,
};

/// Slots of the measured machine, those of a robot.
const SLOTS: usize = match option_env!("PROBE_SLOTS") {
    None => 400,
    Some(slots) => match usize::from_str_radix(slots, 10) {
        Ok(slots) => slots,
        Err(_) => panic!("PROBE_SLOTS is no number"),
    },
};

/// The parts of the measured machine, as bits; all parts by default.
const PARTS: Parts = match option_env!("PROBE_PARTS") {
    None => Parts::ALL,
    Some(bits) => match u16::from_str_radix(bits, 10) {
        Ok(bits) => Parts::from_bits(bits),
        Err(_) => panic!("PROBE_PARTS is no number"),
    },
};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn the_program_contains_a_panic() -> !;
    }
    // SAFETY: the function does not exist, so this call never links.
    unsafe { the_program_contains_a_panic() }
}

struct Probe;

impl Host<Numbers> for Probe {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _: u16,
        _: CallArguments<'_, Numbers, C, SLOTS>,
        _: bool,
    ) -> Result<Reply<Numbers>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, _: CallArguments<'_, Numbers, C, SLOTS>) {}

    fn delay_is_over(&mut self, _: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<Numbers>) -> Option<usize> {
        // The compiler must not know the received bytes; otherwise it would remove the code that
        // handles them.
        let length = core::hint::black_box(&mut *frame).len();
        sighting.place = Some([Value::int(length as i32); 3]);
        Some(length)
    }

    fn send(&mut self, frame: &[u8]) {
        core::hint::black_box(frame);
    }
}

/// An image for a machine with these parts.
#[derive(Clone, Copy)]
struct Code(&'static [u8]);

impl ByteCode for Code {
    const PARTS: Parts = PARTS;

    #[inline(always)]
    fn len(&self) -> usize {
        ByteCode::len(&self.0)
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        self.0.byte(at)
    }

    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        self.0.word(at)
    }
}

/// The image. `black_box` hides its bytes from the compiler, which could otherwise predict the
/// script.
#[used]
static IMAGE: [u8; 64] = [0; 64];

#[cortex_m_rt::entry]
fn main() -> ! {
    // The entry macro turns this into a reference, because main runs once.
    static mut VM: Vm<Numbers, Code, SLOTS> = Vm::new();
    if cfg!(not(feature = "empty")) {
        if PARTS.has(Part::Neighbors) {
            VM.set_network_capacity(core::hint::black_box(Sizes::NONE));
        }
        let image = Code(core::hint::black_box(&IMAGE));
        if VM.load(Image::new(image), |hash| hash == 1).is_ok() {
            for entry in [Entry::Global, Entry::Init, Entry::Step, Entry::Reset, Entry::Destroy] {
                if VM.begin(entry) {
                    core::hint::black_box(VM.run(&mut Probe, 1000));
                }
            }
        }
    }
    loop {}
}
