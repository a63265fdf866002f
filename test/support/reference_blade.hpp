// A blade file as strips for the reference rotor: a second reading of what sim/rotor/rotor.cpp prepares for the fast solve. Tables of
// polars are read directly, without resampling.
#pragma once
#include "sim/rotor/blade.hpp"
#include "sim/rotor/reference/geometry.hpp"

namespace rotorloop::sim {

// Of a blade file: chord and twist by monotone cubics (Fritsch & Butland 1984), polars blended between stations, stall delay by
// section. The blade must outlive the geometry. Strips shrink towards hub and tip, where Prandtl's loss falls like a square root.
ReferenceGeometry reference_geometry(const Blade& blade, int elements);

}  // namespace rotorloop::sim
