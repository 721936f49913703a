; Says "ok", shows colors, turns motors, and reads every sensor.
#define __SFR_OFFSET 0
#include <avr/io.h>
#define readings 0x100
#define pins 0x120
.macro read_adc where
    rcall convert
    lds r16, ADCL
    sts \where, r16
    lds r16, ADCH
    sts \where + 1, r16
.endm
    clr r1
    ; As the oscillator was calibrated; a reset leaves it beside that.
    ldi r16, 0x9c
    sts OSCCAL, r16
    ; UBRR 12 is 38400 baud at 8 MHz.
    ldi r16, BAUD
    sts UBRR0L, r16
    ldi r16, 1 << TXEN0
    sts UCSR0B, r16
    ldi r17, 'o'
    rcall say
    ldi r17, 'k'
    rcall say
    ; Strong red, weak green, all of blue.
    sbi DDRD, 4
    sbi DDRC, 3
    sbi DDRC, 4
    sbi DDRC, 5
    ; A segment whose pin is high is dark.
    sbi PORTC, 3
    ; Left 75 of 255, right off, then all of it; then the pins are inputs.
    ldi r16, (1 << COM2A1) | (1 << COM2B1) | (1 << WGM20)
    sts TCCR2A, r16
    ldi r16, 1 << CS21
    sts TCCR2B, r16
    ldi r16, 75
    sts OCR2A, r16
    sbi DDRB, 3
    sbi DDRD, 3
    ldi r16, 255
    sts OCR2B, r16
    cbi DDRB, 3
    cbi DDRD, 3
    ; Battery and light by the supply, temperature by 1.1 V, these by the supply.
    ldi r16, 6
    sts ADMUX, r16
    read_adc readings
    ldi r16, 7
    sts ADMUX, r16
    read_adc readings + 2
    ldi r16, (1 << REFS1) | (1 << REFS0) | 8
    sts ADMUX, r16
    read_adc readings + 4
    ldi r16, 14
    sts ADMUX, r16
    read_adc readings + 6
    ; PD0 is low while charging; writing PIND toggles one pin of port D.
    in r16, PIND
    sts pins, r16
    sbi PIND, 7
    in r16, PORTD
    sts pins + 1, r16
1:  rjmp 1b
say:
    lds r16, UCSR0A
    sbrs r16, UDRE0
    rjmp say
    sts UDR0, r17
    ret
convert:
    ldi r16, (1 << ADEN) | (1 << ADSC) | (1 << ADPS2) | (1 << ADPS1) | (1 << ADPS0)
    sts ADCSRA, r16
1:  lds r16, ADCSRA
    sbrc r16, ADSC
    rjmp 1b
    ret
