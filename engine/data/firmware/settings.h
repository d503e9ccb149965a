// What differs from one build to the next: EDIT it.
#pragma once

#include "controller.h"

struct ServoSettings {
  uint8_t pin;
  // Pulse widths in microseconds at which the arm stands at 0 degrees (all cables released) and at 180
  // degrees (contracted). Measure them for every servo: command 0, then 180 (type a0 and a180), and
  // change the number until the arm stands where it should. If a servo turns the wrong way round,
  // exchange its two numbers.
  uint16_t releasedUs;
  uint16_t contractedUs;
};

// Shortest and longest pulse that is ever sent; beyond these a servo can be damaged.
const uint16_t SHORTEST_PULSE_US = @shortest_pulse@;
const uint16_t LONGEST_PULSE_US = @longest_pulse@;

// One line per module, numbered as on the build sheet. The pins suit an Arduino Uno or Nano and most
// boards of their shape, or an ESP32 development board; change them freely.
#if defined(ESP32)
const ServoSettings SERVOS[tsmr::MODULES] = {
@servos_esp32@
};
#else
const ServoSettings SERVOS[tsmr::MODULES] = {
@servos@
};
#endif

// A button from this pin to ground starts and stops the robot, as do g and s typed over the serial line.
const uint8_t START_PIN = @start_pin@;

// Seconds after which the robot stops by itself; 0: never.
const uint32_t STOP_AFTER_S = 300;

// How long the last known inputs are used when a host falls silent, in milliseconds. Then the servos
// release and wait for it.
const uint32_t HOST_PATIENCE_MS = @patience_ms@;
