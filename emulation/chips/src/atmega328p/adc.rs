//! The analog-to-digital converter (chapter 24).

/// ADCSRA.
const ADEN: u8 = 1 << 7;
const ADSC: u8 = 1 << 6;
const ADATE: u8 = 1 << 5;
const ADIF: u8 = 1 << 4;
const ADIE: u8 = 1 << 3;
/// ADMUX.
const ADLAR: u8 = 1 << 5;

/// Sources that may start a conversion: the values of ADTS in ADCSRB.
pub const FREE_RUNNING: u8 = 0;
pub const COMPARATOR: u8 = 1;
pub const CAPTURE: u8 = 7;

/// An input to be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AdcSample {
    /// ADMUX.MUX.
    pub channel: u8,
    /// ADMUX.REFS.
    pub reference: u8,
    /// The time in cycles of the peripherals' clock.
    pub at: u64,
}

/// The converter.
#[derive(Clone, Debug, Default)]
pub struct Adc {
    admux: u8,
    adcsra: u8,
    adcsrb: u8,
    result: u16,
    /// True if ADCL was read: the result is locked until ADCH is read.
    is_locked: bool,
    /// True before the first conversion since the converter was turned on, which takes longer.
    is_fresh: bool,
    /// The cycle at which the prescaler was 0.
    origin: u64,
    conversion: Option<Conversion>,
    /// True if the firmware selected a trigger that is not modeled.
    pub is_unknown_trigger: bool,
}

#[derive(Clone, Debug)]
struct Conversion {
    /// The cycle at which the input is sampled; none once it was sampled.
    sample: Option<u64>,
    end: u64,
    value: u16,
}

impl Adc {
    fn divider(&self) -> u64 {
        // Table 24-5.
        1 << (self.adcsra & 7).max(1)
    }

    fn start(&mut self, now: u64, is_triggered: bool) {
        if self.adcsra & ADEN == 0 || self.conversion.is_some() {
            return;
        }
        let divider = self.divider();
        let first = std::mem::take(&mut self.is_fresh);
        // A trigger resets the prescaler. Otherwise the conversion begins with the next clock of
        // the converter.
        let begin = if is_triggered {
            self.origin = now;
            now
        } else {
            self.origin + (now - self.origin).div_ceil(divider) * divider
        };
        // The times of table 24-1, in halves of the converter's clock.
        let (sample, end) = match (first, is_triggered) {
            (true, _) => (27, 50),
            (false, false) => (3, 26),
            (false, true) => (4, 27),
        };
        self.conversion = Some(Conversion {
            sample: Some(begin + sample * divider / 2),
            end: begin + end * divider / 2,
            value: 0,
        });
        self.adcsra |= ADSC;
    }

    /// Handles a trigger: the flag of `source`, which may start a conversion, was set.
    pub fn trigger(&mut self, source: u8, now: u64) {
        if self.adcsra & ADATE != 0 && self.adcsrb & 7 == source && source != FREE_RUNNING {
            self.start(now, true);
        }
    }

    /// Starts a conversion, as entering the sleep mode "ADC noise reduction" does.
    pub fn start_for_sleep(&mut self, now: u64) {
        self.start(now, false);
    }

    pub fn next_event(&self) -> Option<u64> {
        self.conversion.as_ref().map(|conversion| conversion.sample.unwrap_or(conversion.end))
    }

    /// Returns the input to be measured at `now`, if there is one. Its value must be passed to
    /// [`measured`](Self::measured).
    pub fn sample(&mut self, now: u64) -> Option<AdcSample> {
        let conversion = self.conversion.as_mut()?;
        let at = conversion.sample.filter(|at| *at <= now)?;
        conversion.sample = None;
        Some(AdcSample { channel: self.admux & 0xf, reference: self.admux >> 6, at })
    }

    pub fn measured(&mut self, value: u16) {
        if let Some(conversion) = &mut self.conversion {
            conversion.value = value.min(0x3ff);
        }
    }

    /// Ends the conversion that is over by now.
    pub fn finish(&mut self, now: u64) {
        let over = |conversion: &Conversion| conversion.sample.is_none() && conversion.end <= now;
        if !self.conversion.as_ref().is_some_and(over) {
            return;
        }
        let Some(conversion) = self.conversion.take() else { return };
        if !self.is_locked {
            self.result = conversion.value;
        }
        self.adcsra = self.adcsra & !ADSC | ADIF;
        if self.adcsra & ADATE != 0 && self.adcsrb & 7 == FREE_RUNNING {
            self.start(conversion.end, false);
        }
    }

    pub fn interrupts(&self) -> bool {
        self.adcsra & (ADIF | ADIE) == ADIF | ADIE
    }

    pub fn acknowledge(&mut self) {
        self.adcsra &= !ADIF;
    }

    fn adjusted(&self) -> [u8; 2] {
        let shift = if self.admux & ADLAR != 0 { 6 } else { 0 };
        (self.result << shift).to_le_bytes()
    }

    pub fn low(&mut self) -> u8 {
        self.is_locked = true;
        self.adjusted()[0]
    }

    pub fn high(&mut self) -> u8 {
        self.is_locked = false;
        self.adjusted()[1]
    }

    pub fn admux(&self) -> u8 {
        self.admux
    }

    pub fn adcsra(&self) -> u8 {
        self.adcsra
    }

    pub fn adcsrb(&self) -> u8 {
        self.adcsrb
    }

    pub fn set_admux(&mut self, value: u8) {
        self.admux = value;
    }

    pub fn set_adcsra(&mut self, value: u8, now: u64) {
        // ADIF is cleared by writing one. ADSC cannot be cleared.
        let flag = self.adcsra & ADIF & !value;
        let was = std::mem::replace(&mut self.adcsra, value & !(ADIF | ADSC) | flag);
        if value & ADEN == 0 {
            self.conversion = None;
            return;
        }
        if was & ADEN == 0 {
            (self.is_fresh, self.origin) = (true, now);
        }
        if self.conversion.is_some() {
            self.adcsra |= ADSC;
        }
        if value & ADSC != 0 {
            self.start(now, false);
        }
        self.check_trigger();
    }

    pub fn set_adcsrb(&mut self, value: u8) {
        self.adcsrb = value;
        self.check_trigger();
    }

    fn check_trigger(&mut self) {
        let source = self.adcsrb & 7;
        self.is_unknown_trigger |= self.adcsra & (ADEN | ADATE) == ADEN | ADATE
            && ![FREE_RUNNING, COMPARATOR, CAPTURE].contains(&source);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs a conversion; returns the times at which the input was sampled and the conversion
    /// ended.
    fn convert(adc: &mut Adc) -> [u64; 2] {
        let sampled = adc.next_event().unwrap();
        let sample = adc.sample(sampled).unwrap();
        assert_eq!(sample.at, sampled);
        adc.measured(0x2a5);
        let end = adc.next_event().unwrap();
        adc.finish(end - 1);
        assert_ne!(adc.adcsra() & ADSC, 0);
        adc.finish(end);
        assert_eq!(adc.adcsra() & ADSC, 0);
        [sampled, end]
    }

    #[test]
    fn conversions_take_the_data_sheets_time() {
        // Table 24-1, at 1 MHz: the first conversion takes 25 clocks and the others 13, sampled
        // after 13.5 and 1.5; a triggered one takes 13.5, sampled after 2.
        let mut adc = Adc::default();
        adc.set_adcsra(ADEN | ADSC | 3, 100);
        assert_eq!(convert(&mut adc), [100 + 108, 100 + 200]);
        adc.set_adcsra(ADEN | ADSC | ADIF | 3, 308);
        assert_eq!(convert(&mut adc), [308 + 12, 308 + 104]);
        // A start between two clocks of the converter waits for the next one.
        adc.set_adcsra(ADEN | ADSC | ADIF | 3, 501);
        assert_eq!(convert(&mut adc), [508 + 12, 508 + 104]);
        adc.set_adcsra(ADEN | ADATE | 3, 1000);
        adc.set_adcsrb(COMPARATOR);
        adc.trigger(CAPTURE, 2000);
        assert_eq!(adc.next_event(), None);
        adc.trigger(COMPARATOR, 2001);
        adc.trigger(COMPARATOR, 2005);
        assert_eq!(convert(&mut adc), [2001 + 16, 2001 + 108]);
    }

    #[test]
    fn a_result_stays_while_only_its_low_half_was_read() {
        let mut adc = Adc::default();
        adc.set_adcsra(ADEN | ADSC | 3, 0);
        convert(&mut adc);
        assert_eq!((adc.low(), adc.high()), (0xa5, 2));
        adc.set_admux(ADLAR);
        assert_eq!(adc.low(), 0x40);
        adc.set_adcsra(ADEN | ADSC | ADIE | 3, 1000);
        adc.sample(2000);
        adc.measured(1);
        adc.finish(2000);
        assert!(adc.interrupts());
        assert_eq!(adc.high(), 0xa9);
    }
}
