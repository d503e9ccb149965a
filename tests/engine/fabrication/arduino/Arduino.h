// A stand-in for Arduino's core: what the sketch uses of it, with a clock and pins that a test sets.
#pragma once

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string>

#define F(text) (text)
#define LOW 0
#define HIGH 1
#define INPUT_PULLUP 2

namespace bench {
extern uint32_t clockUs;
extern bool buttonDown;
extern std::string typed;
extern std::string printed;
}  // namespace bench

inline uint32_t micros() { return bench::clockUs; }
inline uint32_t millis() { return bench::clockUs / 1000; }
inline void pinMode(uint8_t, uint8_t) {}
inline int digitalRead(uint8_t) { return bench::buttonDown ? LOW : HIGH; }

struct SerialLine {
  void begin(long) {}
  int available() { return int(bench::typed.size()); }
  int read() {
    const int letter = bench::typed[0];
    bench::typed.erase(0, 1);
    return letter;
  }
  long parseInt() {
    const long value = atol(bench::typed.c_str());
    bench::typed.clear();
    return value;
  }
  void print(const char *text) { bench::printed += text; }
  void print(int value) { bench::printed += std::to_string(value); }
  void println(const char *text) { bench::printed += std::string(text) + "\n"; }
  void println(double value, int digits) {
    char text[40];
    snprintf(text, sizeof text, "%.*f\n", digits, value);
    bench::printed += text;
  }
};
extern SerialLine Serial;
