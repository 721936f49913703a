//! The parameters: names and types of Bitcraze's firmware, and limits of this robot.

use crate::toc::{Crc, TocEntry};
use crate::value::WireType;

/// The bit of a parameter that only the robot changes (param.h).
const READ_ONLY: u8 = 0x40;

/// The occasions on which a ground station may change a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Never: only the robot changes it.
    ReadOnly,
    Always,
    /// While the robot does not fly.
    OnGround,
    /// An upper limit: in flight it can only fall.
    UpperLimit,
    /// A lower limit: in flight it can only rise.
    LowerLimit,
}

/// Declares the parameters once: the enum, names, types, access, first value and range.
macro_rules! parameters {
    ($($parameter:ident: $group:literal $name:literal $wire:ident $access:ident
        $first:literal in $least:literal..$most:literal,)*) => {
        /// A parameter.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        #[repr(u8)]
        pub enum Parameter {
            $($parameter,)*
        }

        impl Parameter {
            /// All parameters; the id of each is its index.
            pub const ALL: &[Parameter] = &[$(Parameter::$parameter,)*];
            /// The number of parameters.
            pub const COUNT: usize = Parameter::ALL.len();

            /// Returns the group's name.
            pub const fn group(self) -> &'static str {
                match self { $(Parameter::$parameter => $group,)* }
            }

            /// Returns the name in the group.
            pub const fn name(self) -> &'static str {
                match self { $(Parameter::$parameter => $name,)* }
            }

            /// Returns the type.
            pub const fn wire(self) -> WireType {
                match self { $(Parameter::$parameter => WireType::$wire,)* }
            }

            /// Returns the occasions on which a ground station may change it.
            pub const fn access(self) -> Access {
                match self { $(Parameter::$parameter => Access::$access,)* }
            }

            /// Returns the value after power-on.
            pub const fn first(self) -> f32 {
                match self { $(Parameter::$parameter => $first,)* }
            }

            /// Returns the least and the greatest value that a ground station may write.
            pub const fn range(self) -> (f32, f32) {
                match self { $(Parameter::$parameter => ($least, $most),)* }
            }
        }
    };
}

// A parameter with one value in its range cannot change, and describes the robot to stations: the
// planner always works (`enHighLevel`), the filter is an extended Kalman filter (2), and the
// controller is geometric as Lee's (5).
parameters! {
    CommanderEnHighLevel: "commander" "enHighLevel" U8 Always 1.0 in 1.0..1.0,
    StabilizerEstimator: "stabilizer" "estimator" U8 Always 2.0 in 2.0..2.0,
    StabilizerController: "stabilizer" "controller" U8 Always 5.0 in 5.0..5.0,
    StabilizerStop: "stabilizer" "stop" U8 Always 0.0 in 0.0..255.0,
    KalmanResetEstimation: "kalman" "resetEstimation" U8 OnGround 0.0 in 0.0..1.0,
    KalmanInitialX: "kalman" "initialX" F32 OnGround 0.0 in -1000.0..1000.0,
    KalmanInitialY: "kalman" "initialY" F32 OnGround 0.0 in -1000.0..1000.0,
    KalmanInitialZ: "kalman" "initialZ" F32 OnGround 0.0 in -1000.0..1000.0,
    KalmanInitialYaw: "kalman" "initialYaw" F32 OnGround 0.0 in -100.0..100.0,
    LocSrvExtPosStdDev: "locSrv" "extPosStdDev" F32 Always 0.001 in 0.0001..1.0,
    LocSrvExtQuatStdDev: "locSrv" "extQuatStdDev" F32 Always 0.005 in 0.0001..1.0,
    HlCommanderVtoff: "hlCommander" "vtoff" F32 Always 0.5 in 0.05..2.0,
    HlCommanderVland: "hlCommander" "vland" F32 Always 0.5 in 0.05..2.0,
    HlCommanderGroupmask: "hlCommander" "groupmask" U8 Always 0.0 in 0.0..255.0,
    PosCtlXVelMax: "posCtlPid" "xVelMax" F32 UpperLimit 1.0 in 0.05..1.5,
    PosCtlYVelMax: "posCtlPid" "yVelMax" F32 UpperLimit 1.0 in 0.05..1.5,
    PosCtlZVelMax: "posCtlPid" "zVelMax" F32 UpperLimit 0.5 in 0.05..0.7,
    FenceLeastX: "fence" "leastX" F32 LowerLimit -1000.0 in -1000.0..1000.0,
    FenceLeastY: "fence" "leastY" F32 LowerLimit -1000.0 in -1000.0..1000.0,
    FenceLeastZ: "fence" "leastZ" F32 LowerLimit -1000.0 in -1000.0..1000.0,
    FenceMostX: "fence" "mostX" F32 UpperLimit 1000.0 in -1000.0..1000.0,
    FenceMostY: "fence" "mostY" F32 UpperLimit 1000.0 in -1000.0..1000.0,
    FenceMostZ: "fence" "mostZ" F32 UpperLimit 1000.0 in -1000.0..1000.0,
    PmLowVoltage: "pm" "lowVoltage" F32 LowerLimit 3.2 in 3.2..4.2,
    PmCriticalLowVoltage: "pm" "criticalLowVoltage" F32 LowerLimit 3.0 in 3.0..4.2,
    DeckBcFlow2: "deck" "bcFlow2" U8 ReadOnly 0.0 in 0.0..0.0,
    DeckBcZRanger2: "deck" "bcZRanger2" U8 ReadOnly 0.0 in 0.0..0.0,
    DeckBcMultiranger: "deck" "bcMultiranger" U8 ReadOnly 0.0 in 0.0..0.0,
    DeckBcLighthouse4: "deck" "bcLighthouse4" U8 ReadOnly 0.0 in 0.0..0.0,
    DeckBcLoco: "deck" "bcLoco" U8 ReadOnly 0.0 in 0.0..0.0,
    ImuSensorsBmp3xx: "imu_sensors" "BMP3XX" U8 ReadOnly 0.0 in 0.0..0.0,
    SystemSelftestPassed: "system" "selftestPassed" I8 ReadOnly 0.0 in 0.0..0.0,
    FirmwareRevision0: "firmware" "revision0" U32 ReadOnly 0.0 in 0.0..0.0,
    FirmwareRevision1: "firmware" "revision1" U16 ReadOnly 0.0 in 0.0..0.0,
    FirmwareModified: "firmware" "modified" U8 ReadOnly 0.0 in 0.0..0.0,
}

impl Parameter {
    /// Returns the parameter with this id.
    pub fn of_id(id: u16) -> Option<Self> {
        Parameter::ALL.get(usize::from(id)).copied()
    }

    pub(crate) const fn entry(self) -> TocEntry {
        let access = match self.access() {
            Access::ReadOnly => READ_ONLY,
            _ => 0,
        };
        let code = self.wire().parameter_code() | access;
        TocEntry { group: self.group(), name: self.name(), code }
    }
}

/// The checksum of the table.
pub(crate) const CRC: u32 = {
    let mut crc = Crc::new();
    let mut rest = Parameter::ALL;
    while let [parameter, others @ ..] = rest {
        let entry = parameter.entry();
        assert!(entry.fits(), "the names do not fit a packet");
        crc = crc.with(&entry);
        rest = others;
    }
    crc.value()
};
