//! External interrupts of pins (RM0090 12, RM0091 11.2) and the selection of the pins (SYSCFG,
//! RM0090 9.3, RM0091 9.1).

use super::bus::{Lines, Write};
use super::gpio::GpioPort;

pub(crate) struct Exti {
    /// The NVIC interrupt of each line.
    irq: [u8; 16],
    imr: u32,
    emr: u32,
    rtsr: u32,
    ftsr: u32,
    swier: u32,
    pending: u32,
    /// SYSCFG_EXTICR1 to 4.
    exticr: [u32; 4],
    /// Levels of the selected pins.
    levels: u32,
    /// The requests that [`Exti::drive`] last put on the interrupt lines.
    driven: u32,
}

impl Exti {
    /// Creates a controller whose lines 0 to 15 raise these interrupts.
    pub fn new(irq: [u8; 16]) -> Self {
        Exti {
            irq,
            imr: 0,
            emr: 0,
            rtsr: 0,
            ftsr: 0,
            swier: 0,
            pending: 0,
            exticr: [0; 4],
            levels: 0,
            driven: 0,
        }
    }

    /// Returns the port whose pin is connected to line `line`.
    pub fn port(&self, line: u8) -> usize {
        (self.exticr[usize::from(line / 4)] >> (4 * (line % 4)) & 0xf) as usize
    }

    /// Returns true if edges of this pin raise an interrupt.
    pub fn is_enabled(&self, port: usize, pin: u8) -> bool {
        (self.imr & (self.rtsr | self.ftsr)) >> pin & 1 != 0 && self.port(pin) == port
    }

    /// Updates the levels of the selected pins; an enabled edge becomes pending.
    fn observe(&mut self, levels: u32) {
        let rising = levels & !self.levels & self.rtsr;
        let falling = !levels & self.levels & self.ftsr;
        self.levels = levels;
        self.pending |= rising | falling;
    }

    /// Updates the levels of the selected pins from the ports of the chip.
    pub fn observe_ports(&mut self, ports: &[GpioPort]) {
        let levels = (0..16).fold(0, |levels, line| {
            let high = ports.get(self.port(line)).is_some_and(|port| port.level(line));
            levels | u32::from(high) << line
        });
        self.observe(levels);
    }

    /// Updates the level of the pin of one line.
    pub fn observe_one(&mut self, line: u8, high: bool) {
        self.observe(self.levels & !(1 << line) | u32::from(high) << line);
    }

    pub fn drive(&mut self, lines: &mut Lines) {
        let requests = self.pending & self.imr;
        if requests == std::mem::replace(&mut self.driven, requests) {
            return;
        }
        for irq in self.irq {
            let high = (0..16).any(|line| self.irq[line] == irq && requests >> line & 1 != 0);
            lines.set(irq, high);
        }
    }

    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 => self.imr,
            0x04 => self.emr,
            0x08 => self.rtsr,
            0x0c => self.ftsr,
            0x10 => self.swier,
            0x14 => self.pending,
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, write: Write) {
        match offset {
            0x00 => self.imr = write.merge(self.imr),
            0x04 => self.emr = write.merge(self.emr),
            0x08 => self.rtsr = write.merge(self.rtsr),
            0x0c => self.ftsr = write.merge(self.ftsr),
            0x10 => {
                let risen = write.merge(self.swier) & !self.swier;
                self.swier |= risen;
                self.pending |= risen;
            }
            // Bits of PR are cleared by writing ones; the same bits of SWIER are cleared, too
            // (12.3.5, 12.3.6).
            0x14 => {
                self.pending &= !write.ones();
                self.swier &= !write.ones();
            }
            _ => {}
        }
    }

    pub fn read_choice(&self, register: usize) -> u32 {
        self.exticr[register]
    }

    pub fn write_choice(&mut self, register: usize, write: Write) {
        self.exticr[register] = write.merge(self.exticr[register]) & 0xffff;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Width;

    /// The interrupts of the STM32F405 (RM0090 table 62).
    const IRQ: [u8; 16] = [6, 7, 8, 9, 10, 23, 23, 23, 23, 23, 40, 40, 40, 40, 40, 40];

    #[test]
    fn edges_raise_the_chosen_interrupt() {
        let mut exti = Exti::new(IRQ);
        let word = |value| Write::new(0, Width::Word, value);
        exti.write(0x00, word(1 << 4 | 1 << 14));
        exti.write(0x08, word(1 << 4));
        exti.write(0x0c, word(1 << 14));
        let mut lines = Lines::default();
        let mut lines = |exti: &mut Exti| {
            exti.drive(&mut lines);
            lines.bits()
        };
        exti.observe(1 << 4 | 1 << 14);
        assert_eq!(lines(&mut exti), 1 << 10, "rising edge at line 4 only");
        exti.write(0x14, word(1 << 4));
        assert_eq!(lines(&mut exti), 0);
        exti.observe(0);
        assert_eq!(lines(&mut exti), 1 << 40, "falling edge at line 14 only");
    }

    #[test]
    fn the_port_of_a_line_follows_exticr() {
        let mut exti = Exti::new(IRQ);
        exti.write_choice(3, Write::new(0, Width::Word, 2 << 8));
        assert_eq!(exti.port(14), 2);
        assert_eq!(exti.port(13), 0);
    }
}
