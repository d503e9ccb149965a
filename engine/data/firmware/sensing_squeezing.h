//
// Return true and set how far the target is from the head, and its bearing; false if that is not known.
inline bool senseTarget(tsmr::real *distance, tsmr::real *bearing) {
  // With positions from a camera above: tsmr::towards(headX, headY, direction, targetX, targetY, distance,
  // bearing); return true;
  (void)distance;
  (void)bearing;
  return false;
}

// The same for the middle of the aperture's entrance, and whether the head is past it.
inline bool senseGate(tsmr::real *distance, tsmr::real *bearing, bool *past) {
  (void)distance;
  (void)bearing;
  (void)past;
  return false;
}

// Return the distance from the head straight ahead to a wall, such as a range finder measures; very far
// if there is none.
inline tsmr::real senseClearance() { return 100; }

// What the network is told; nothing to fill in. It was evolved with these units.
inline bool senseInputs(tsmr::real *inputs) {
  tsmr::real distance, bearing, gateDistance, gateBearing;
  bool past;
  if (!senseTarget(&distance, &bearing) || !senseGate(&gateDistance, &gateBearing, &past)) return false;
  inputs[0] = @unit_0@distance;
  inputs[1] = @unit_1@bearing;
  inputs[2] = @unit_2@(past ? -gateDistance : gateDistance);
  inputs[3] = @unit_3@gateBearing;
  inputs[4] = senseClearance() <= tsmr::real(@range@) ? 1 : 0;
  return true;
}
