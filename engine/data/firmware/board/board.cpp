// The sketch on this computer, with its clock in the hands of another program.
//
// That one writes how many milliseconds shall pass and how many bytes of the serial line follow, as two
// 32-bit numbers in the machine's own bytes, then those bytes. It gets the number of bytes printed, those,
// and the pulse of every servo in microseconds as 32-bit numbers. Once it does so before the first request.
#include <stdio.h>

#include "Arduino.h"
#include "tsmr_robot.ino"

namespace board {
uint32_t clockUs = 0;
bool buttonDown = false;
std::string received;
std::string printed;
}  // namespace board
SerialLine Serial;

static void answer() {
  const uint32_t n = uint32_t(board::printed.size());
  fwrite(&n, sizeof n, 1, stdout);
  fwrite(board::printed.data(), 1, n, stdout);
  board::printed.clear();
  for (uint8_t m = 0; m < tsmr::MODULES; ++m) {
    const uint32_t pulse = uint32_t(servos[m].pulseUs);
    fwrite(&pulse, sizeof pulse, 1, stdout);
  }
  fflush(stdout);
}

int main() {
  setup();
  answer();
  uint32_t request[2];
  while (fread(request, sizeof request, 1, stdin) == 1) {
    std::string bytes(request[1], '\0');
    if (request[1] > 0 && fread(&bytes[0], 1, request[1], stdin) != request[1]) return 1;
    board::received += bytes;
    for (uint32_t k = 0; k < request[0]; ++k) {
      board::clockUs += 1000;
      loop();
    }
    answer();
  }
  return 0;
}
