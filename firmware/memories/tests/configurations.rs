//! Configurations that Bitcraze's cflib (0417fba, i2c_element.py) wrote.

use bittybuzz_comms::syslink::{DataRate, RadioSettings};
use bittybuzz_memories::{CONFIGURATION_BYTES, Configuration, ConfigurationError, Trim};

const DEFAULT: &str = "307842430150020000000000000000e7e7e7e7e703";
/// Channel 60, 1 Mbit/s, pitch 1.5°, roll -0.25°, address E7E7E7E701.
const OTHER: &str = "30784243013c010000c03f000080bee701e7e7e745";
/// Version 0: channel 100, 250 kbit/s, pitch -2°, roll 3.5°.
const OLD: &str = "30784243006400000000c000006040f1";
const CHANNEL_126: &str = "30784243017e020000000000000000e7e7e7e7e731";
const SPEED_3: &str = "307842430150030000000000000000e7e7e7e7e704";
const TRIM_NOT_A_NUMBER: &str = "307842430150020000c07f00000000e7e7e7e7e742";
/// A roll of 10^9°, channel 5, address 0123456789.
const TRIM_HUGE: &str = "3078424301050200000000286b6e4e0189674523dd";

fn decode(digits: &str) -> Result<Configuration, ConfigurationError> {
    let memory = crate::contents::memory(digits);
    Configuration::decode(memory.first_chunk::<CONFIGURATION_BYTES>().expect("it is longer"))
}

#[test]
fn configurations_of_cflib_are_decoded() {
    assert_eq!(decode(DEFAULT), Ok(Configuration::DEFAULT));
    let configuration = |channel, data_rate, address, pitch_degrees, roll_degrees| Configuration {
        radio: RadioSettings { channel, data_rate, address, power: 0 },
        trim: Trim { pitch_degrees, roll_degrees },
    };
    let address = [0x01, 0xe7, 0xe7, 0xe7, 0xe7];
    assert_eq!(decode(OTHER), Ok(configuration(60, DataRate::Megabit1, address, 1.5, -0.25)));
    let old = configuration(100, DataRate::Kilobits250, [0xe7; 5], -2.0, 3.5);
    assert_eq!(decode(OLD), Ok(old));
}

#[test]
fn values_out_of_range_are_refused() {
    for (digits, error) in [
        (CHANNEL_126, ConfigurationError::Channel(126)),
        (SPEED_3, ConfigurationError::Speed(3)),
        (TRIM_NOT_A_NUMBER, ConfigurationError::Trim),
        (TRIM_HUGE, ConfigurationError::Trim),
        ("", ConfigurationError::Missing),
        ("0000000000000000000000000000000000000000", ConfigurationError::Missing),
    ] {
        assert_eq!(decode(digits), Err(error), "{digits}");
    }
}

/// A sum detects every changed bit.
#[test]
fn every_changed_bit_is_detected() {
    for (digits, length) in [(OTHER, 21), (OLD, 16)] {
        let memory = crate::contents::memory(digits);
        let intact: [u8; CONFIGURATION_BYTES] = *memory.first_chunk().unwrap();
        for bit in 0..8 * length {
            let mut damaged = intact;
            damaged[bit / 8] ^= 1 << (bit % 8);
            let error = Configuration::decode(&damaged).unwrap_err();
            match bit / 8 {
                0..4 => assert_eq!(error, ConfigurationError::Missing),
                // One version becomes the other, whose checksum has another place.
                4 if bit % 8 == 0 => assert_eq!(error, ConfigurationError::Damaged),
                4 => assert!(matches!(error, ConfigurationError::UnknownVersion(_))),
                _ => assert_eq!(error, ConfigurationError::Damaged, "bit {bit}"),
            }
        }
    }
}
