"""Physical numbers of one robot: materials, cut list, cable net, parts, firmware."""
