; Writes 0x5a to cell 0xb0 by kilolib's way, measures how long that takes, and reads it back.
#define __SFR_OFFSET 0
#include <avr/io.h>
#define took 0x100
#define back 0x102
    clr r1
    ldi r16, 0xb0
    out EEARL, r16
    out EEARH, r1
    ldi r16, 0x5a
    out EEDR, r16
    ; Without its key, nothing is written.
    sbi EECR, EEPE
    sbi EECR, EEMPE
    sbi EECR, EEPE
    ldi r16, 1 << CS10
    sts TCCR1B, r16
1:  sbic EECR, EEPE
    rjmp 1b
    lds r16, TCNT1L
    sts took, r16
    lds r16, TCNT1H
    sts took + 1, r16
    out EEDR, r1
    sbi EECR, EERE
    in r16, EEDR
    sts back, r16
1:  rjmp 1b
