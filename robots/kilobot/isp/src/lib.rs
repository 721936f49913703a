//! The content of a Kilobot's memories with a given script.
//!
//! A Kilobot has no region of its own for a script: the script directly follows the firmware, and
//! both are written as one [`program`]: by a programmer on the robot's ISP header, or by the
//! overhead controller. A programmer erases the whole chip first, so the boot loader and the
//! calibration, which are in the same [`memories`], are written back.
//!
//! # Principles
//! 1. **Bytes in, bytes out.** The caller reads and writes files, and calls the programmer.
//! 2. **Files are not trusted.** Each mistake of a file is a [`program::ProgramError`].

pub mod memories;
pub mod program;
