"""The science of TensAtlas: bodies, controllers, physics, search. Imports neither viz nor app."""
