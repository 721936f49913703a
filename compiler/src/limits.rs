//! The limits of an image, which the checks report with a place in the source and the assembler
//! keeps for every producer of images.

/// The maximum number of parameters in a function header.
pub const PARAMETERS_MAX: usize = 31;
/// The maximum number of slots that a function may need above its frame record.
pub const DEPTH_MAX: usize = 200;
/// The maximum number of arguments in a call of a built-in or robot function.
pub const ARGUMENTS_MAX: usize = 127;
/// The maximum number of values that a closure can capture, its self included.
pub const CAPTURES_MAX: usize = 199;
