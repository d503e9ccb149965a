// A stand-in for Arduino's core: what the sketch uses of it, with a clock, a serial line and pins that a
// program on this computer sets.
#pragma once

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string>

#define F(text) (text)
#define LOW 0
#define HIGH 1
#define INPUT_PULLUP 2

namespace board {
extern uint32_t clockUs;
extern bool buttonDown;
extern std::string received;
extern std::string printed;
}  // namespace board

inline uint32_t micros() { return board::clockUs; }
inline uint32_t millis() { return board::clockUs / 1000; }
inline void pinMode(uint8_t, uint8_t) {}
inline int digitalRead(uint8_t) { return board::buttonDown ? LOW : HIGH; }

struct SerialLine {
  void begin(long) {}
  int available() { return int(board::received.size()); }
  int read() {
    const int letter = board::received[0];
    board::received.erase(0, 1);
    return letter;
  }
  void print(const char *text) { board::printed += text; }
  void print(int value) { board::printed += std::to_string(value); }
  void println(const char *text) { board::printed += std::string(text) + "\r\n"; }
  void println(int value) { board::printed += std::to_string(value) + "\r\n"; }
  void println(uint32_t value) { board::printed += std::to_string(value) + "\r\n"; }
  void println(double value, int digits) {
    char text[40];
    snprintf(text, sizeof text, "%.*f\r\n", digits, value);
    board::printed += text;
  }
};
extern SerialLine Serial;
