"""The science of TensAtlas: bodies, controllers, physics, search. Runs headless; imports neither viz nor app."""
