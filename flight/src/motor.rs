//! Motors: from thrust to duty, with compensation of the battery and of the lag of the rotors.
