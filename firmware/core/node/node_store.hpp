// Joins a node to its store, as every application does: parameters at the start, save and erase when the bus asks.
#pragma once
#include "firmware/core/node/esc_node.hpp"
#include "firmware/core/node/parameter_store.hpp"

namespace rotorloop::firmware {

// On defaults and never spinning when the store is empty or damaged.
template <ParameterFlash Flash>
EscNode make_node(const ParameterStore<Flash>& store, const NodeIdentity& identity) {
  const StoredParameters stored = store.load();
  EscNode node(stored.parameters, identity);
  node.report_store(stored.state);
  return node;
}

// After each poll(). Blocks for as long as the flash takes: the node asks for it only while the motor is off.
template <ParameterFlash Flash>
void serve_store(EscNode& node, ParameterStore<Flash>& store) {
  if (node.request() == NodeRequest::save) node.complete(store.save(node.edited()));
  if (node.request() == NodeRequest::erase) node.complete(store.save(Parameters{}));
}

}  // namespace rotorloop::firmware
