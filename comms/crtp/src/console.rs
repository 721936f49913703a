//! Text for the console of ground stations: port 0.

use crate::packet::{DATA_MAX, Packet, Port};

/// Splits a text into packets. Each has whole characters, since cflib decodes packets one by one
/// (cflib/crazyflie/console.py).
pub fn console(text: &str) -> impl Iterator<Item = Packet> + '_ {
    let mut rest = text;
    core::iter::from_fn(move || {
        let (part, others) = rest.split_at_checked(rest.floor_char_boundary(DATA_MAX))?;
        rest = others;
        (!part.is_empty()).then(|| Packet::new(Port::Console, 0).with(part.as_bytes()))
    })
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    #[test]
    fn packets_have_whole_characters() {
        let text = "µ".repeat(15) + "abcé" + &"x".repeat(27) + "é" + "\n";
        let packets: Vec<Packet> = console(&text).collect();
        let parts: Vec<&str> =
            packets.iter().map(|packet| str::from_utf8(&packet.bytes()[1..]).unwrap()).collect();
        assert_eq!(parts.concat(), text);
        assert_eq!(packets[0].bytes()[0], 0);
        assert_eq!(parts[0].len(), 30);
        assert!(parts.iter().all(|part| part.len() <= 30));
        assert_eq!(console("").count(), 0);
    }
}
