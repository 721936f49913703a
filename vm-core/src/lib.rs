//! The BittyBuzz virtual machine.

#![no_std]
#![forbid(unsafe_code)]

pub mod link;
pub mod number;
