//! Numbers: the two number profiles and everything that is computed with them.
//!
//! Scripts must compute the same on every robot of a swarm, whatever its processor. So nothing here
//! calls a platform's mathematical library, uses binary64 or contracts `a * b + c`: floats see only
//! IEEE binary32 `+ - * /`, which hardware and soft-float libraries round alike, and integers.
//! Nothing here panics: integer operations wrap, and no table is indexed by a computed value.

#[cfg(feature = "maths")]
mod exponential;
mod float16;
mod format;
pub mod maths;
mod mixed;
mod profile;
mod rng;
mod rounding;
#[cfg(feature = "maths")]
mod trigonometry;
mod wide;

#[cfg(feature = "maths")]
pub use exponential::power;
pub use float16::F16;
pub use format::{format_float, format_int, parse_float, parse_int};
pub use mixed::{Number, compare, normalize_key, to_int};
pub use profile::{Full, Profile, Tiny};
pub use rng::Rng;
pub use rounding::{abs, ceil, float_modulo, floor, round};
