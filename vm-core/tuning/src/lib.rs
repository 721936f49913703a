//! The two attributes by which the virtual machine trades flash for time.
//!
//! The compiler inlines by the size of functions, not by the flash that a chip lacks. On the AVR it then copies whole searches into every
//! instruction that needs them, and calls subroutines for a single load. These attributes decide instead.
//!
//! They are procedural macros because those of `macro_rules` would have to wrap whole functions, inside which rustfmt formats
//! nothing. An attribute keeps the documentation, the format and the line numbers of its function.

use proc_macro::TokenStream;

/// The function becomes a part of each caller.
///
/// For functions that are smaller than their call, and for those on the path of every instruction. The compiler mostly
/// agrees: `#[inline]` in place of all of them makes the AVR's machine 46 bytes larger, of 42,561 with everything in `tiny` and
/// before tools/squeeze; in `number` it changes nothing.
#[proc_macro_attribute]
pub fn hot(_: TokenStream, function: TokenStream) -> TokenStream {
    with_attribute("#[inline(always)]", function)
}

/// The function becomes a part of each caller, but on a Cortex-M0.
///
/// For a few functions on the path of some instructions only. The Zooid, the smallest robot whose image has all parts of the
/// machine, has the Cortex-M0, and no flash to spare: the copies of `order_of` alone take 96 bytes of it. Atomic instructions tell the
/// Cortex-M0 from larger ones.
#[proc_macro_attribute]
pub fn warm(_: TokenStream, function: TokenStream) -> TokenStream {
    let is_small = "all(target_arch = \"arm\", not(target_has_atomic = \"ptr\"))";
    let attributes = format!(
        "#[cfg_attr({is_small}, inline(never))] #[cfg_attr(not({is_small}), inline(always))]"
    );
    with_attribute(&attributes, function)
}

/// The function stays one copy, which all callers share.
///
/// For functions whose copies take more flash than the calls. Without it the AVR's machine would be 9,880 bytes larger, of 42,561
/// with everything in `tiny` and before tools/squeeze. The slots, values and cells of the heap alone are 3,360 of them,
/// numbers 1,440, the network 1,376, messages 298.
///
/// Computers with 64 bits do not lack memory for code, and the compiler decides there, but in builds with debug assertions, which
/// are compiled often. With the arithmetic of `number/wide.rs` of the machine, the worlds of `tests/scenarios/speed-*.toml` take 19 to
/// 26 % fewer instructions.
#[proc_macro_attribute]
pub fn one_copy(_: TokenStream, function: TokenStream) -> TokenStream {
    let is_roomy = "all(target_pointer_width = \"64\", not(debug_assertions))";
    let attributes =
        format!("#[cfg_attr({is_roomy}, inline)] #[cfg_attr(not({is_roomy}), inline(never))]");
    with_attribute(&attributes, function)
}

fn with_attribute(attribute: &str, function: TokenStream) -> TokenStream {
    let attribute = attribute.parse::<TokenStream>();
    attribute.into_iter().flatten().chain(function).collect()
}
