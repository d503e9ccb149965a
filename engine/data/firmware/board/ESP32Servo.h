// A stand-in for the ESP32Servo library, whose servos are told the same as Arduino's.
#pragma once

#include "Servo.h"
