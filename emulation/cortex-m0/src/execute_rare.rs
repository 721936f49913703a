//! Instructions that the fast loop of `execute.rs` does not handle: accesses outside RAM, and those
//! that concern exceptions.

use bittybuzz_chips::{Board, Width};

use crate::bus::Bus;
use crate::decode::{Op, Operation};
use crate::exception::Lockup;
use crate::registers::{PC, Processor};

impl Processor {
    /// Executes `op`, the instruction at `at`. The PC already points after it, and its cycles are
    /// counted.
    #[inline(never)]
    pub fn execute_rare<B: Board>(
        &mut self,
        bus: &mut Bus<B>,
        op: Op,
        at: u32,
    ) -> Result<(), Lockup> {
        let Op { kind, d, b, imm, .. } = op;
        match kind {
            Operation::Cps => self.mask(bus, imm != 0),
            Operation::Mrs => {
                self.r[PC] = at.wrapping_add(4);
                let value = self.special(bus, imm);
                self.set(d, value);
            }
            Operation::Msr => {
                self.r[PC] = at.wrapping_add(4);
                self.set_special(bus, imm, self.get(d));
            }
            Operation::SupervisorCall => return self.call_supervisor(bus, at),
            Operation::Bx => return self.exchange(bus, self.get_high(b, at.wrapping_add(4))),
            Operation::Blx => {
                let to = self.get(b);
                self.link(at.wrapping_add(2));
                return self.exchange(bus, to);
            }
            Operation::PopPc => {
                return match self.pop_to(bus, op.list()) {
                    Some(to) => self.exchange(bus, to),
                    None => self.fault(bus, at),
                };
            }
            _ => {
                if self.access(bus, op, at).is_none() {
                    return self.fault(bus, at);
                }
            }
        }
        Ok(())
    }

    /// Branches to an address, whose lowest bit selects Thumb code, or returns from an exception.
    fn exchange<B: Board>(&mut self, bus: &mut Bus<B>, to: u32) -> Result<(), Lockup> {
        if to >> 28 == 0xf && bus.nvic.current() != 0 {
            bus.deadline = 0;
            return self.leave(bus, to);
        }
        self.r[PC] = to & !1;
        if to & 1 == 0 { self.fault(bus, to & !1) } else { Ok(()) }
    }

    /// Executes an access to memory. Returns none if there is no such memory, or if `op` is no such
    /// instruction.
    fn access<B: Board>(&mut self, bus: &mut Bus<B>, op: Op, at: u32) -> Option<()> {
        let Op { kind, d, b, c, imm } = op;
        let (by_register, by_number) =
            (self.get(b).wrapping_add(self.get(c)), self.get(b).wrapping_add(imm));
        let value = self.get(d);
        let value = match kind {
            Operation::LdrLiteral => {
                bus.read((at.wrapping_add(4) & !3).wrapping_add(imm), Width::Word)?
            }
            Operation::LdrReg => bus.read(by_register, Width::Word)?,
            Operation::LdrImm => bus.read(by_number, Width::Word)?,
            Operation::LdrhReg => bus.read(by_register, Width::Half)? & 0xffff,
            Operation::LdrhImm => bus.read(by_number, Width::Half)? & 0xffff,
            Operation::LdrbReg => bus.read(by_register, Width::Byte)? & 0xff,
            Operation::LdrbImm => bus.read(by_number, Width::Byte)? & 0xff,
            Operation::LdrshReg => i32::from(bus.read(by_register, Width::Half)? as i16) as u32,
            Operation::LdrsbReg => i32::from(bus.read(by_register, Width::Byte)? as i8) as u32,
            Operation::StrReg => return bus.write(by_register, Width::Word, value),
            Operation::StrImm => return bus.write(by_number, Width::Word, value),
            Operation::StrhReg => return bus.write(by_register, Width::Half, value & 0xffff),
            Operation::StrhImm => return bus.write(by_number, Width::Half, value & 0xffff),
            Operation::StrbReg => return bus.write(by_register, Width::Byte, value & 0xff),
            Operation::StrbImm => return bus.write(by_number, Width::Byte, value & 0xff),
            Operation::Push => return self.push(bus, op.list()),
            Operation::Pop => return self.pop(bus, op.list()),
            Operation::Stm => return self.store_many(bus, b, op.list()),
            Operation::Ldm => return self.load_many(bus, b, op.list()),
            _ => return None,
        };
        self.set(d, value);
        Some(())
    }
}
