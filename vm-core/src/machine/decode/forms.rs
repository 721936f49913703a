//! The decoder that tests the form of an instruction by its upper bits before it looks up the
//! opcode.

/// Decodes the instruction at `pc`, and moves `pc` after opcode and operand. Short reads are
/// executed at once.
///
/// This is a macro, because a function would return an enum on which the loop branches again, which
/// takes 2 % of all instructions of a Cortex-M0. The macro uses the loop's `get`, `fp` and `push`,
/// and continues at its label.
macro_rules! decode_form {
    ($code:ident at $pc:ident, $op:ident $arg:ident, $run:lifetime) => {
        $op = $code.byte($pc);
        $pc = $pc.wrapping_add(1);
        $arg = 0;
        if $op & 0xc0 == 0x80 {
            // Short forms, by the ranges of `opcode::SHORTS`.
            let low = isize::from($op & 0x0f);
            ($op, $arg) = match $op & 0x30 {
                0x00 => {
                    let local = low + opcode::SHORT_LOCAL_GET.low as isize;
                    let value = get!(fp!().wrapping_add_signed(local));
                    if value.is(Tag::UNSET) {
                        $op = opcode::LOCAL_GET;
                        break $run LoopExit::Undone;
                    }
                    push!(value);
                    continue $run;
                }
                0x10 => (opcode::INT, low + opcode::SHORT_INT.low as isize),
                0x20 => {
                    push!(get!(GLOBALS + low as usize));
                    continue $run;
                }
                _ if $op & 0x08 == 0 => (opcode::GLOBAL_SET, low),
                _ if $op & 0x04 == 0 => (opcode::RETURN, low & 0x03),
                _ => (opcode::RETURN_NIL, low & 0x03),
            };
        } else if $op & 0x40 != 0 {
            if $op & WIDE == 0 {
                $arg = isize::from($code.byte($pc) as i8);
                $pc = $pc.wrapping_add(1);
            } else {
                $arg = isize::from($code.word($pc) as i16);
                $pc = $pc.wrapping_add(2);
                $op &= !WIDE;
            }
        }
    };
}
pub(in crate::machine) use decode_form;
