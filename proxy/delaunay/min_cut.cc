#include "proxy/delaunay/min_cut.h"

#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/property_map/property_map.hpp>
#include <utility>

namespace lumi {

std::vector<std::uint8_t> SolveMinCut(const Tetrahedra& tets, const CutProblem& problem) {
  using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, boost::no_property,
                                                   boost::no_property, std::uint32_t, std::uint32_t>;
  using Edge = boost::graph_traits<Graph>::edge_descriptor;

  // Vertices: the cells, then source and sink. A cell's edges: its four facets, then one to the terminal that its net
  // terminal capacity points to; min(source, sink) flows through in any case. The terminals' edges come last.
  const std::size_t n = tets.cells.size();
  const auto source = static_cast<std::uint32_t>(n);
  const auto sink = static_cast<std::uint32_t>(n + 1);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ends;
  std::vector<Capacity> capacity;
  std::vector<std::uint32_t> reverse;
  ends.reserve(7 * n);
  capacity.reserve(7 * n);
  std::vector<std::uint32_t> first_edge(n), to_source, to_sink;  // edge numbers
  for (std::size_t c = 0; c < n; ++c) {
    first_edge[c] = static_cast<std::uint32_t>(ends.size());
    for (std::size_t i = 0; i < 4; ++i) {
      ends.emplace_back(static_cast<std::uint32_t>(c), static_cast<std::uint32_t>(tets.cells[c].neighbor[i]));
      capacity.push_back(problem.facet[c][i]);
    }
    const Capacity net = problem.source[c] - problem.sink[c];
    if (net == 0) continue;
    (net > 0 ? to_source : to_sink).push_back(static_cast<std::uint32_t>(ends.size()));
    ends.emplace_back(static_cast<std::uint32_t>(c), net > 0 ? source : sink);
    capacity.push_back(net > 0 ? 0 : -net);
  }
  reverse.resize(ends.size() + to_source.size() + to_sink.size());
  const auto add_terminal_edges = [&](std::uint32_t terminal, const std::vector<std::uint32_t>& edges) {
    for (const std::uint32_t e : edges) {
      const std::uint32_t cell = ends[e].first;
      const auto back = static_cast<std::uint32_t>(ends.size());
      ends.emplace_back(terminal, cell);
      capacity.push_back(terminal == source ? problem.source[cell] - problem.sink[cell] : 0);
      reverse[e] = back;
      reverse[back] = e;
    }
  };
  add_terminal_edges(source, to_source);
  add_terminal_edges(sink, to_sink);
  for (std::size_t c = 0; c < n; ++c) {
    for (std::size_t i = 0; i < 4; ++i) {
      const auto other = static_cast<std::size_t>(tets.cells[c].neighbor[i]);
      std::size_t j = 0;
      while (tets.cells[other].neighbor[j] != static_cast<std::int32_t>(c)) ++j;
      reverse[first_edge[c] + i] = first_edge[other] + static_cast<std::uint32_t>(j);
    }
  }

  const Graph graph(boost::edges_are_sorted, ends.begin(), ends.end(), static_cast<std::uint32_t>(n + 2));
  std::vector<Edge> edge_of(ends.size());
  {
    std::size_t e = 0;
    for (auto [it, end] = boost::edges(graph); it != end; ++it) edge_of[e++] = *it;
  }
  std::vector<Edge> reverse_edge(ends.size());
  for (std::size_t e = 0; e < ends.size(); ++e) reverse_edge[e] = edge_of[reverse[e]];
  std::vector<Capacity> residual(ends.size());
  std::vector<Edge> predecessor(n + 2);
  std::vector<boost::default_color_type> color(n + 2);
  std::vector<std::uint32_t> distance(n + 2);
  const auto edge_index = boost::get(boost::edge_index, graph);
  const auto vertex_index = boost::get(boost::vertex_index, graph);
  const auto edge_map = [&](auto& values) { return boost::make_iterator_property_map(values.begin(), edge_index); };
  const auto vertex_map = [&](auto& values) { return boost::make_iterator_property_map(values.begin(), vertex_index); };
  boost::boykov_kolmogorov_max_flow(graph, edge_map(capacity), edge_map(residual), edge_map(reverse_edge),
                                    vertex_map(predecessor), vertex_map(color), vertex_map(distance), vertex_index,
                                    source, sink);
  std::vector<std::uint8_t> free(n);
  const auto source_color = boost::color_traits<boost::default_color_type>::black();
  for (std::size_t c = 0; c < n; ++c) free[c] = color[c] == source_color ? 1 : 0;
  return free;
}

}  // namespace lumi
