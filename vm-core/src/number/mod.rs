//! Numbers: the two number profiles and everything that is computed with them.
//!
//! Scripts must compute the same on every robot of a swarm, whatever its processor. So nothing here
//! calls a platform's mathematical library, uses binary64 or contracts `a * b + c`: floats see only
//! IEEE binary32 `+ - * /`, which hardware and soft-float libraries round alike, and integers.
//! Nothing here panics: integer operations wrap, and no table is indexed by a computed value.

mod float16;
mod profile;

pub use float16::F16;
pub use profile::{Full, Profile, Tiny};
