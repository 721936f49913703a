//! Writes the images that the fuzz target `image` starts from into a folder.

use std::path::PathBuf;

fn main() -> std::io::Result<()> {
    let folder = PathBuf::from(std::env::args().nth(1).expect("a folder"));
    for (number, image) in bittybuzz_fuzz_bodies::images().iter().enumerate() {
        std::fs::write(folder.join(format!("known-{number}")), image)?;
    }
    Ok(())
}
