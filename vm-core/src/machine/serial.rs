//! Values that need more than a frame: to the content of fragments, and back to the heap.
use super::Vm;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::message::{self, Fragment};
use crate::network::Network;
use crate::number::Profile;
use crate::value::Value;

impl<P: Profile, C: ByteCode, const SLOTS: usize, N: Network<P>> Vm<P, C, SLOTS, N> {
    pub(super) fn sendable(
        &mut self,
        _stigmergy: u8,
        _key: Value<P>,
        value: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        if value.is_plain() {
            Ok(value)
        } else {
            Err(self.fail_on(FaultCode::NotSendable, value, value))
        }
    }
    pub(super) fn broadcast_long<H: Host<P>>(
        &mut self,
        _host: &mut H,
        _topic: Value<P>,
        value: Value<P>,
    ) -> Result<(), Stopped> {
        Err(self.fail_on(FaultCode::NotSendable, value, value))
    }
    pub(super) fn send_long_entry<H: Host<P>>(
        &mut self,
        _host: &mut H,
        _entry: &message::Entry<P>,
    ) {
    }
    pub(super) fn assemble<H: Host<P>>(
        &mut self,
        _host: &mut H,
        _fragment: &Fragment<'_>,
    ) -> Result<(), Stopped> {
        Ok(())
    }
}
