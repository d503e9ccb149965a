// Tries the sketch on a computer: numbers come in and go out as doubles in the machine's own bytes.
#include <stdlib.h>

#include "Arduino.h"
#include "tsmr_robot.ino"

namespace bench {
uint32_t clockUs = 4294000000u;  // wraps around within the first second
bool buttonDown = false;
std::string typed;
std::string printed;
}  // namespace bench
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

// The whole sketch for as many seconds as asked: the pulse of every servo after every control update.
static void sketch(double seconds) {
  setup();
  bench::typed = "g";
  loop();
  for (uint32_t k = 1; k * 1000.0 <= seconds * 1e6; ++k) {
    bench::clockUs += 1000;
    const uint32_t before = update;
    loop();
    if (update != before) {
      for (uint8_t m = 0; m < tsmr::MODULES; ++m) give(double(servos[m].pulseUs));
    }
  }
  fprintf(stderr, "%s", bench::printed.c_str());
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
    bench::buttonDown = press % 2 == 0;
    for (int k = 0; k < 200; ++k) {
      bench::clockUs += 1000;
      loop();
    }
  }
  bench::typed = "a180";
  loop();
  for (uint8_t m = 0; m < tsmr::MODULES; ++m) give(double(servos[m].pulseUs)), give(double(servos[m].pin));
  fprintf(stderr, "%s", bench::printed.c_str());
}

int main(int, char **arguments) {
  const std::string what = arguments[1];
  if (what == "network") network();
  if (what == "sketch") sketch(atof(arguments[2]));
  if (what == "lengths") lengths();
  if (what == "hands") hands();
  return 0;
}
