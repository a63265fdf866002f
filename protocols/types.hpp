// The DroneCAN data types that the toolkit speaks (docs/wire.md §2). Each is a plain struct with its id, signature and one
// description of its fields, from which encode() and decode() of dsdl.hpp follow. Source: public DSDL definitions of DroneCAN; a
// test computes every signature from the description. Units stand in the members' names.
#pragma once
#include "protocols/dsdl.hpp"
#include "protocols/transfer.hpp"
#include "protocols/types/debug.hpp"
#include "protocols/types/esc.hpp"
#include "protocols/types/file.hpp"
#include "protocols/types/node.hpp"
#include "protocols/types/param.hpp"
