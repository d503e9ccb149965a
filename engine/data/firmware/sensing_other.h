//
// The task @task@ has inputs of its own, in the units of its file. Return true and set all of them, or
// false if they are not known:
@names@
inline bool senseInputs(tsmr::real *inputs) {
  (void)inputs;
  return false;
}
