//! The physics of a Crazyflie: a rigid body with four rotors, a battery, the air around it, the
//! ground below it, and its sensors.
