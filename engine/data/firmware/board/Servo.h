// A stand-in for Arduino's Servo library, which remembers what it was told and clamps it as that does.
#pragma once

struct Servo {
  int pin = -1;
  int pulseUs = 1500;
  int shortestUs = 544;
  int longestUs = 2400;
  void attach(int where, int shortest = 544, int longest = 2400) {
    pin = where;
    shortestUs = shortest;
    longestUs = longest;
  }
  void writeMicroseconds(int us) { pulseUs = us < shortestUs ? shortestUs : (us > longestUs ? longestUs : us); }
};
