// What the robot senses: FILL IN the functions below for your sensors.
//
// In the simulation the controller is told where its target is; how a real robot finds out is open.
// Any of these will do: a camera above the arena that tracks the head and sends positions by radio; a
// beacon with a receiver on the head (strength for the distance, two receivers for the bearing); an
// ultra-wideband tag and a compass. As delivered the functions know nothing, and the robot falls back
// to an open loop: see FALLBACK_INPUTS in settings.h.
//
// The head is module @head@, the @end@ of the chain. Its position is the middle of its front face, the
// face that looks away from the chain; it points from the middle of the opposite face to that one.
// Bearings are in rad, 0 straight ahead, positive to the left, from -pi to pi. Lengths are in m.
#pragma once

#include "controller.h"

// Called once, when the board starts.
inline void beginSensing() {}

// Called at every control update, @rate@ times a second: must return within @budget@ ms.
@functions@
