//
// Return true and set how far the target is from the head, and its bearing; false if that is not known.
inline bool senseTarget(tsmr::real *distance, tsmr::real *bearing) {
  // With positions from a camera above: tsmr::towards(headX, headY, direction, targetX, targetY, distance,
  // bearing); return true;
  (void)distance;
  (void)bearing;
  return false;
}

// What the network is told; nothing to fill in. It was evolved with these units.
inline bool senseInputs(tsmr::real *inputs) {
  tsmr::real distance, bearing;
  if (!senseTarget(&distance, &bearing)) return false;
  inputs[0] = @unit_0@distance;
  inputs[1] = @unit_1@bearing;
  return true;
}
