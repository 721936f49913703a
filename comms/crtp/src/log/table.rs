//! The log variables: names and types of Bitcraze's firmware, units of its documentation.

use crate::toc::{Crc, TocEntry};
use crate::value::WireType;

/// Declares the variables once: the enum, their names and types.
macro_rules! variables {
    ($($variable:ident: $group:literal $name:literal $wire:ident,)*) => {
        /// A log variable. Angles are in degrees here, and pitch is positive with the nose up, as
        /// ground stations expect. `stateEstimateZ` is in mm and mm/s, with a quaternion of
        /// [`pack_quaternion`](crate::pack_quaternion).
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum LogVariable {
            $($variable,)*
        }

        impl LogVariable {
            /// All variables; the id of each is its index.
            pub const ALL: &[LogVariable] = &[$(LogVariable::$variable,)*];

            /// Returns the group's name.
            pub const fn group(self) -> &'static str {
                match self { $(LogVariable::$variable => $group,)* }
            }

            /// Returns the name in the group.
            pub const fn name(self) -> &'static str {
                match self { $(LogVariable::$variable => $name,)* }
            }

            /// Returns the type in which the table offers the variable.
            pub const fn wire(self) -> WireType {
                match self { $(LogVariable::$variable => WireType::$wire,)* }
            }
        }
    };
}

variables! {
    StateEstimateX: "stateEstimate" "x" F32,
    StateEstimateY: "stateEstimate" "y" F32,
    StateEstimateZ: "stateEstimate" "z" F32,
    StateEstimateVx: "stateEstimate" "vx" F32,
    StateEstimateVy: "stateEstimate" "vy" F32,
    StateEstimateVz: "stateEstimate" "vz" F32,
    StateEstimateAx: "stateEstimate" "ax" F32,
    StateEstimateAy: "stateEstimate" "ay" F32,
    StateEstimateAz: "stateEstimate" "az" F32,
    StateEstimateRoll: "stateEstimate" "roll" F32,
    StateEstimatePitch: "stateEstimate" "pitch" F32,
    StateEstimateYaw: "stateEstimate" "yaw" F32,
    StateEstimateQx: "stateEstimate" "qx" F32,
    StateEstimateQy: "stateEstimate" "qy" F32,
    StateEstimateQz: "stateEstimate" "qz" F32,
    StateEstimateQw: "stateEstimate" "qw" F32,
    StateEstimateZX: "stateEstimateZ" "x" I16,
    StateEstimateZY: "stateEstimateZ" "y" I16,
    StateEstimateZZ: "stateEstimateZ" "z" I16,
    StateEstimateZVx: "stateEstimateZ" "vx" I16,
    StateEstimateZVy: "stateEstimateZ" "vy" I16,
    StateEstimateZVz: "stateEstimateZ" "vz" I16,
    StateEstimateZQuat: "stateEstimateZ" "quat" U32,
    StabilizerRoll: "stabilizer" "roll" F32,
    StabilizerPitch: "stabilizer" "pitch" F32,
    StabilizerYaw: "stabilizer" "yaw" F32,
    StabilizerThrust: "stabilizer" "thrust" F32,
    TargetX: "ctrltarget" "x" F32,
    TargetY: "ctrltarget" "y" F32,
    TargetZ: "ctrltarget" "z" F32,
    TargetVx: "ctrltarget" "vx" F32,
    TargetVy: "ctrltarget" "vy" F32,
    TargetVz: "ctrltarget" "vz" F32,
    TargetRoll: "ctrltarget" "roll" F32,
    TargetPitch: "ctrltarget" "pitch" F32,
    TargetYaw: "ctrltarget" "yaw" F32,
    KalmanStateX: "kalman" "stateX" F32,
    KalmanStateY: "kalman" "stateY" F32,
    KalmanStateZ: "kalman" "stateZ" F32,
    KalmanStatePx: "kalman" "statePX" F32,
    KalmanStatePy: "kalman" "statePY" F32,
    KalmanStatePz: "kalman" "statePZ" F32,
    KalmanVarX: "kalman" "varX" F32,
    KalmanVarY: "kalman" "varY" F32,
    KalmanVarZ: "kalman" "varZ" F32,
    KalmanVarPx: "kalman" "varPX" F32,
    KalmanVarPy: "kalman" "varPY" F32,
    KalmanVarPz: "kalman" "varPZ" F32,
    KalmanQ0: "kalman" "q0" F32,
    KalmanQ1: "kalman" "q1" F32,
    KalmanQ2: "kalman" "q2" F32,
    KalmanQ3: "kalman" "q3" F32,
    GyroX: "gyro" "x" F32,
    GyroY: "gyro" "y" F32,
    GyroZ: "gyro" "z" F32,
    AccX: "acc" "x" F32,
    AccY: "acc" "y" F32,
    AccZ: "acc" "z" F32,
    BaroAsl: "baro" "asl" F32,
    BaroTemp: "baro" "temp" F32,
    BaroPressure: "baro" "pressure" F32,
    MotorM1: "motor" "m1" U16,
    MotorM2: "motor" "m2" U16,
    MotorM3: "motor" "m3" U16,
    MotorM4: "motor" "m4" U16,
    PmVbat: "pm" "vbat" F32,
    PmVbatMv: "pm" "vbatMV" U16,
    PmState: "pm" "state" I8,
    PmBatteryLevel: "pm" "batteryLevel" U8,
    SupervisorInfo: "supervisor" "info" U16,
    SysCanFly: "sys" "canfly" U8,
    SysIsFlying: "sys" "isFlying" U8,
    SysIsTumbled: "sys" "isTumbled" U8,
    RadioRssi: "radio" "rssi" U8,
    RadioIsConnected: "radio" "isConnected" U8,
    RadioNumRxBc: "radio" "numRxBc" U16,
    RadioNumRxUc: "radio" "numRxUc" U16,
    RangeFront: "range" "front" U16,
    RangeBack: "range" "back" U16,
    RangeUp: "range" "up" U16,
    RangeLeft: "range" "left" U16,
    RangeRight: "range" "right" U16,
    RangeZ: "range" "zrange" U16,
    LocSrvX: "locSrv" "x" F32,
    LocSrvY: "locSrv" "y" F32,
    LocSrvZ: "locSrv" "z" F32,
    LocSrvQx: "locSrv" "qx" F32,
    LocSrvQy: "locSrv" "qy" F32,
    LocSrvQz: "locSrv" "qz" F32,
    LocSrvQw: "locSrv" "qw" F32,
}

impl LogVariable {
    /// Returns the variable with this id.
    pub fn of_id(id: u16) -> Option<Self> {
        LogVariable::ALL.get(usize::from(id)).copied()
    }

    pub(crate) const fn entry(self) -> TocEntry {
        TocEntry { group: self.group(), name: self.name(), code: self.wire().log_code() }
    }
}

/// The checksum of the table.
pub(crate) const CRC: u32 = {
    let mut crc = Crc::new();
    let mut rest = LogVariable::ALL;
    while let [variable, others @ ..] = rest {
        let entry = variable.entry();
        assert!(entry.fits(), "the names do not fit a packet");
        crc = crc.with(&entry);
        rest = others;
    }
    crc.value()
};
