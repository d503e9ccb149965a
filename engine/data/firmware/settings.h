// What differs from one build to the next: EDIT it.
#pragma once

#include "controller.h"

struct ServoSettings {
  uint8_t pin;
  // Pulse widths in microseconds at which the arm stands at 0 degrees (all cables released) and at 180
  // degrees (contracted). Measure them for every servo: command 0, then 180 (type a0 and a180), and
  // change the number until the arm stands where it should. If a servo turns the wrong way round,
  // exchange its two numbers. Values outside 500 to 2500 can damage a servo.
  uint16_t releasedUs;
  uint16_t contractedUs;
};

// One line per module, numbered as on the build sheet. The pins suit an Arduino Uno or Nano and most
// boards of their shape; change them freely.
const ServoSettings SERVOS[tsmr::MODULES] = {
@servos@
};

// A button from this pin to ground starts and stops the robot, as do g and s typed over the serial line.
const uint8_t START_PIN = 12;

// Seconds after which the robot stops by itself; 0: never.
const uint32_t STOP_AFTER_S = 300;

// How long the last known inputs are used when the sensors know nothing, in milliseconds.
const uint32_t SENSOR_PATIENCE_MS = 1000;

// After that the network is told this, and every module keeps a fixed rhythm: an open loop. These are
// the inputs at the start of a trial, the target being @target@.
const tsmr::real FALLBACK_INPUTS[tsmr::INPUTS] = {@start_inputs@};
