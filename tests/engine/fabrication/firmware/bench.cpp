// Tries the sketch on a computer: numbers come in and go out as doubles in the machine's own bytes.
#include <stdlib.h>

#include "Arduino.h"
#include "tsmr_robot.ino"

namespace board {
uint32_t clockUs = 4294000000u;  // wraps around within the first second
bool buttonDown = false;
std::string received;
std::string printed;
}  // namespace board
SerialLine Serial;

static bool take(double *values, size_t n) { return fread(values, sizeof(double), n, stdin) == n; }
static void give(double value) { fwrite(&value, sizeof value, 1, stdout); }

// Inputs of the network to its outputs, then the chosen frequency and phase of each module as built.
static void network() {
  double in[tsmr::INPUTS];
  while (take(in, tsmr::INPUTS)) {
    tsmr::real inputs[tsmr::INPUTS], outputs[tsmr::OUTPUTS];
    for (int i = 0; i < tsmr::INPUTS; ++i) inputs[i] = tsmr::real(in[i]);
    tsmr::think(inputs, outputs);
    for (int i = 0; i < tsmr::OUTPUTS; ++i) give(double(outputs[i]));
    for (uint8_t m = 0; m < tsmr::MODULES; ++m) {
      const tsmr::Gait gait = tsmr::gaitOf(outputs, m);
      give(double(tsmr::FREQUENCY_HZ[gait.frequency]));
      give(double(tsmr::PHASE_RAD[gait.phase]));
    }
  }
}

// Lines of a host, each after so many milliseconds: "40 t450,0". The pulse of every servo after every
// control update, and what the sketch prints.
static void host() {
  setup();
  unsigned wait;
  char text[2000];
  while (scanf("%u %1999[^\n]", &wait, text) == 2) {
    for (unsigned k = 0; k < wait; ++k) {
      board::clockUs += 1000;
      const uint32_t before = update;
      loop();
      if (running && update != before) {
        for (uint8_t m = 0; m < tsmr::MODULES; ++m) give(double(servos[m].pulseUs));
      }
    }
    board::received += std::string(text) + "\n";
    loop();
  }
  fprintf(stderr, "%s", board::printed.c_str());
}

// Cable lengths at commands from 0 to 180 degrees.
static void lengths() {
  double degrees;
  while (take(&degrees, 1)) {
    for (uint8_t c = 0; c < tsmr::CABLES; ++c) give(double(tsmr::cableLengthMm(tsmr::real(degrees), c)));
  }
}

// What a user does: the button down and up, a command for the bench; answers on the serial line.
static void hands() {
  setup();
  for (int press = 0; press < 4; ++press) {
    board::buttonDown = press % 2 == 0;
    for (int k = 0; k < 200; ++k) {
      board::clockUs += 1000;
      loop();
    }
  }
  board::received = "a180\n";
  loop();
  for (uint8_t m = 0; m < tsmr::MODULES; ++m) give(double(servos[m].pulseUs)), give(double(servos[m].pin));
  fprintf(stderr, "%s", board::printed.c_str());
}

int main(int, char **arguments) {
  const std::string what = arguments[1];
  if (what == "network") network();
  if (what == "host") host();
  if (what == "lengths") lengths();
  if (what == "hands") hands();
  return 0;
}
