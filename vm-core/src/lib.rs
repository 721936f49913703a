//! The BittyBuzz virtual machine: runs Buzz scripts on robots with as little as 2 kB of RAM.
//!
//! # Principles
//! 1. **Trust is a type.** An [`Image`] is only alleged to be one; [`Vm::load`] verifies it. The
//!    verified image cannot panic the machine, leave its memory or run for ever in one call.
//!    [`seal`] is for robots that have no room for the verifier.
//! 2. **All memory is one array**, whose size is fixed when the machine is built. There is no
//!    allocator, and nothing grows.
//! 3. **Nothing recurses and nothing blocks.** Calls, iterations, collections and waits keep their
//!    state in the arena; [`Vm::run`] stops after its budget and continues later.
//! 4. **The same result everywhere**, from an 8-bit AVR to the host, bit for bit.
//! 5. **Every fact once**: instructions in [`opcode`], built-ins in [`builtin`].
//!
//! # Parts
//! Every part of the machine is compiled and tested everywhere. Firmware for a small flash leaves
//! out the parts that its scripts do not use, by a constant of the image's type,
//! [`ByteCode::PARTS`]; [`Part`] lists them. The functions of `math` take 3.5 kB of flash on the
//! AVR and 2.2 kB on a Cortex-M; all functions that concern other robots take 17 kB and 13 kB. Only
//! the full profile has strings made at run time.
//!
//! The only cargo feature, `torture`, is off by default. For tests it makes allocations fail and
//! collections frequent on request.
//!
//! # What it will not do
//! The crate does not compile scripts, print, keep text in the tiny profile, or know a robot. The
//! [`Host`] knows the robot and prints.
//!
//! # Use
//! ```
//! use bittybuzz_vm_core::{Entry, Image, ImageError, Outcome, Vm, number::Full};
//!
//! let mut vm: Vm<Full, &[u8], 256> = Vm::new();
//! // Eight bytes are no script: the verifier says why.
//! let refused = vm.load(Image::new(&[0xb5, 0x82, 0, 0, 0, 0, 0, 0]), |_| false);
//! assert_eq!(refused, Err(ImageError::Truncated));
//! assert!(!vm.begin(Entry::Step));
//! ```

#![no_std]
#![forbid(unsafe_code)]

// All modules use its attributes `#[hot]`, `#[warm]` and `#[one_copy]`.
#[macro_use]
extern crate bittybuzz_vm_tuning;

mod arena;
pub mod builtin;
#[cfg(any(target_arch = "avr", test))]
mod byte;
mod bytecode;
mod fault;
pub mod hash;
mod heap;
mod host;
pub mod image;
pub mod inspect;
mod machine;
pub mod message;
mod network;
pub mod number;
pub mod opcode;
mod part;
mod restart;
pub mod rom;
pub mod seal;
mod slots;
pub mod stamp;
#[cfg(feature = "torture")]
mod torture;
mod value;
mod verify;

pub use arena::SLOTS_MAX;
pub use bytecode::{ByteCode, FlashArea, longest_image};
pub use fault::{Fault, FaultCode, Refusal, RobotFault};
pub use host::{Argument, Axis, CallArguments, Host, Reply, Text};
pub use image::{Entry, Image, ImageError};
pub use machine::{Callee, Calls, GLOBALS, Instruction, Outcome, QuickLoop, Vm};
pub use network::{Buffer, ENTRIES_MAX, NetworkCounters, Periods, Places, Sighting, Sizes};
pub use part::{Part, Parts};
pub use restart::Restarts;
pub use slots::Slots;
#[cfg(feature = "torture")]
pub use torture::{CountedCode, Torture};
pub use value::{Type, Value, class};
pub use verify::features;
