; Does what is to be noticed, by FAULT: 1 an instruction that is none; 2 a store beyond all memory; 3 a stack that leaves the RAM;
; 4 a LED that is left on.
#define __SFR_OFFSET 0
#include <avr/io.h>
#if FAULT == 1
    .word 0x9404
#elif FAULT == 2
    sts 0x1000, r16
#elif FAULT == 3
1:  rcall 1b
#elif FAULT == 4
    sbi DDRB, 0
    sbi PORTB, 0
#endif
1:  rjmp 1b
