//! The complementary filter, which estimates attitude and height without a position.
