// A stand-in for Arduino's Servo library, which remembers what it was told.
#pragma once

struct Servo {
  int pin = -1;
  int pulseUs = 1500;
  void attach(int where) { pin = where; }
  void writeMicroseconds(int us) { pulseUs = us; }
};
