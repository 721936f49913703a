//! Finds the program that emulates robots.

use std::env;
use std::path::{Path, PathBuf};

use crate::launch;

/// The program that emulates every robot with an STM32.
pub const STM32: &str = "bbz-emulate-stm32";

/// Returns the path of the `named` emulator, or of the `usual` one if there is no name. A name
/// without folders is searched in the folder of the launch, and then in PATH.
pub fn program(named: Option<&Path>, usual: &str) -> PathBuf {
    let usual = || PathBuf::from(format!("{usual}{}", env::consts::EXE_SUFFIX));
    let name = named.map_or_else(usual, Path::to_owned);
    let beside = match name.components().count() {
        1 => launch::emulators().map(|folder| folder.join(&name)),
        _ => None,
    };
    beside.filter(|path| path.is_file()).unwrap_or(name)
}
