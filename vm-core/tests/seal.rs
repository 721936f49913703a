//! Sealed images: what a robot without a verifier takes, and what it refuses.

use bittybuzz_testkit::{ImageParts, Recorder};
use bittybuzz_vm_core::image::EntryPoint;
use bittybuzz_vm_core::number::{Full, Tiny};
use bittybuzz_vm_core::opcode::*;
use bittybuzz_vm_core::seal::{self, SealedImage};
use bittybuzz_vm_core::{Entry, Image, ImageError, Outcome, Parts, Sizes, Vm, features};

const SLOTS: usize = 120;
const ROBOT: u16 = seal::robot::<Tiny>(features::<Tiny>(), Sizes::NONE, Parts::ALL, &[7, 8]);

/// The global code calls robot function 8 with 3; there is an `init()`.
fn image() -> Vec<u8> {
    let mut parts = ImageParts::new(&[
        &[0, 4, SHORT_INT.first + 4, CALL_ROBOT, 0, 1, POP, 0xbc],
        &[0, 1, 0xbc],
    ]);
    parts.imports = vec![8];
    parts.entries[0] = EntryPoint::Function(1);
    parts.build()
}

fn sealed() -> Vec<u8> {
    let image = image();
    let mut vm: Vm<Tiny, &[u8], SLOTS> = Vm::new();
    vm.load(Image::new(&image), |hash| hash == 7 || hash == 8).expect("the image is sound");
    [image.as_slice(), &vm.seal(ROBOT).expect("there is a program")].concat()
}

fn load(bytes: &[u8], robot: u16) -> Result<(), ImageError> {
    Vm::<Tiny, &[u8], SLOTS>::new().load_sealed(SealedImage::new(bytes), robot)
}

/// What the script does.
fn events(vm: &mut Vm<Tiny, &[u8], SLOTS>) -> Vec<String> {
    let mut host = Recorder::default();
    for entry in [Entry::Global, Entry::Init] {
        assert!(vm.begin(entry), "{entry:?}");
        assert_eq!(vm.run(&mut host, 100), Outcome::Done);
    }
    assert!(!vm.begin(Entry::Step));
    host.lines()
}

#[test]
fn a_sealed_image_runs_like_the_verified_one() {
    let (image, sealed) = (image(), sealed());
    let mut verified: Vm<Tiny, &[u8], SLOTS> = Vm::new();
    verified.load(Image::new(&image), |_| true).unwrap();
    let mut opened: Vm<Tiny, &[u8], SLOTS> = Vm::new();
    opened.load_sealed(SealedImage::new(&sealed), ROBOT).unwrap();
    assert_eq!(opened.header(), verified.header());
    let events = [events(&mut opened), events(&mut verified)];
    assert_eq!(events[0], events[1]);
    assert_eq!(events[0].len(), 1);
}

#[test]
fn every_changed_bit_is_found() {
    let good = sealed();
    assert_eq!(load(&good, ROBOT), Ok(()));
    for at in 0..good.len() {
        for bit in 0..8 {
            let mut bytes = good.clone();
            bytes[at] ^= 1 << bit;
            assert_eq!(load(&bytes, ROBOT), Err(ImageError::Seal), "byte {at}, bit {bit}");
        }
    }
}

#[test]
fn truncated_and_empty_seals_are_refused() {
    let good = sealed();
    for length in 0..good.len() {
        assert_eq!(load(&good[..length], ROBOT), Err(ImageError::Seal), "{length} bytes");
    }
    for fill in [0x00, 0xff] {
        for length in 0..300 {
            assert_eq!(
                load(&vec![fill; length], ROBOT),
                Err(ImageError::Seal),
                "{length} {fill:x}"
            );
        }
    }
    assert_eq!(load(&image(), ROBOT), Err(ImageError::Seal), "an image that nobody has sealed");
}

/// A CRC over bytes and their CRC is 0, so a zero after them changes nothing; a complement does.
#[test]
fn a_seal_with_a_byte_after_it_is_refused() {
    let good = sealed();
    for after in 0..=u8::MAX {
        let bytes = [&good[..], &[after]].concat();
        assert_eq!(load(&bytes, ROBOT), Err(ImageError::Seal), "{after:x}");
    }
}

#[test]
fn a_seal_is_valid_for_one_kind_of_robot() {
    let good = sealed();
    let neighbors = Sizes { neighbors: 4, ..Sizes::NONE };
    for other in [
        seal::robot::<Full>(features::<Full>(), Sizes::NONE, Parts::ALL, &[7, 8]),
        seal::robot::<Tiny>(features::<Tiny>(), Sizes::NONE, Parts::ALL, &[7]),
        seal::robot::<Tiny>(features::<Tiny>(), Sizes::NONE, Parts::ALL, &[7, 9]),
        seal::robot::<Tiny>(features::<Tiny>(), Sizes::NONE, Parts::ALL, &[8, 7]),
        seal::robot::<Tiny>(features::<Tiny>(), Sizes::NONE, Parts::ALL, &[7, 8, 11]),
        seal::robot::<Tiny>(features::<Tiny>(), neighbors, Parts::ALL, &[7, 8]),
        seal::robot::<Tiny>(0, Sizes::NONE, Parts::ALL, &[7, 8]),
    ] {
        assert_eq!(load(&good, other), Err(ImageError::Seal));
    }
    let mut smaller: Vm<Tiny, &[u8], { SLOTS - 1 }> = Vm::new();
    assert_eq!(smaller.load_sealed(SealedImage::new(&good), ROBOT), Err(ImageError::Seal));
}

#[test]
fn only_verified_images_are_sealed() {
    let mut vm: Vm<Tiny, &[u8], SLOTS> = Vm::new();
    assert_eq!(vm.seal(ROBOT), None);
    let mut wrong = image();
    *wrong.last_mut().unwrap() = 0x07;
    assert!(vm.load(Image::new(&wrong), |_| true).is_err());
    assert_eq!(vm.seal(ROBOT), None);
}

/// A machine that refuses an image has none, whatever it had before.
#[test]
fn no_code_runs_after_a_broken_seal() {
    let (good, image) = (sealed(), image());
    let mut vm: Vm<Tiny, &[u8], SLOTS> = Vm::new();
    vm.load_sealed(SealedImage::new(&good), ROBOT).unwrap();
    assert_eq!(vm.load_sealed(SealedImage::new(&image), ROBOT), Err(ImageError::Seal));
    assert!(!vm.begin(Entry::Global));
    assert!(vm.header().is_none());
}
