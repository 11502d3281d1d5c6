// SPDX-License-Identifier: BSD-3-Clause
// Labels grow by moves: a move offers one volume, and a minimum cut tells which voxels take it. The voxels that have a choice
// are the nodes. Costs are integers, so sums do not depend on their order, and the cost of a face is a metric over labels
// (differences of values, truncated, a length, and a price for ending at a border are), which is what makes every move a
// minimum cut.
//
// A flow through noise from one end of an overlap to the other is slow (minutes for a million nodes, by augmenting paths and by
// push-relabel alike), because nothing within the overlap says which side to take. So the cut goes from coarse to fine (Lombaert
// et al. 2005): blocks of 2^d nodes are one node, whose faces sum theirs - the same energy, of labellings that are constant in
// blocks - and the finer cut is sought in a band around the coarser one, as often as that moves it. The energy never rises, and
// small overlaps are cut exactly.
//
// The maximum flow is Boost's Boykov-Kolmogorov. It works on any graph, so it gets one of flat arrays, 16 bytes per arc: its
// own adjacency lists would be five times as large.
//
// Passes: what each volume may show (one byte per voxel of its box); the median difference; then per move one scan that
// numbers the nodes, one that prices their faces, the cut, and one that writes labels.
#include "Filters/Stitching/Benchmarks/SeamCut.h"
#include "Core/Base/Error.h"
#include <algorithm>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/iterator/counting_iterator.hpp>
#include <boost/property_map/property_map.hpp>
#include <cmath>
#include <cstdint>

namespace echorama {

namespace {

// Nodes 0 ... n - 1, then source and sink. Arcs of a node lie together; each has its opposite.
class CutGraph {
public:
  using Arc = std::uint32_t;
  using Node = std::uint32_t;

  struct Face {
    Node from, to;
    std::int32_t forward, backward; // capacities
  };

  // faces: by their from, and for one from by their to. terminals: positive: from the source, negative: to the sink.
  CutGraph(std::size_t nodes, const std::vector<Face>& faces, const std::vector<std::int64_t>& terminals)
    : first_(nodes + 3, 0), source_(static_cast<Node>(nodes)), sink_(static_cast<Node>(nodes + 1))
  {
    const auto count = [&](Node from, Node to) {
      ++first_[from + 1];
      ++first_[to + 1];
    };
    ForFaces(faces, terminals, [&](Node from, Node to, std::int32_t, std::int32_t) { count(from, to); });
    for (std::size_t n = 1; n < first_.size(); ++n)
      first_[n] += first_[n - 1];
    head_.resize(first_.back());
    tail_.resize(first_.back());
    opposite_.resize(first_.back());
    capacity_.resize(first_.back());
    std::vector<Arc> next(first_.begin(), first_.end() - 1);
    ForFaces(faces, terminals, [&](Node from, Node to, std::int32_t forward, std::int32_t backward) {
      const Arc there = next[from]++, back = next[to]++;
      head_[there] = tail_[back] = to;
      tail_[there] = head_[back] = from;
      opposite_[there] = back;
      opposite_[back] = there;
      capacity_[there] = forward;
      capacity_[back] = backward;
    });
  }

  std::size_t NodeCount() const { return first_.size() - 1; } // with source and sink
  std::size_t ArcCount() const { return head_.size(); }
  Arc First(Node node) const { return first_[node]; }
  Arc End(Node node) const { return first_[node + 1]; }
  Node Head(Arc arc) const { return head_[arc]; }
  Node Tail(Arc arc) const { return tail_[arc]; }
  Node Source() const { return source_; }
  Node Sink() const { return sink_; }
  const std::vector<Arc>& Opposite() const { return opposite_; }
  std::vector<std::int32_t>& Capacity() { return capacity_; }

private:
  template <class Body>
  void ForFaces(const std::vector<Face>& faces, const std::vector<std::int64_t>& terminals, const Body& body) const
  {
    for (const Face& face : faces)
      body(face.from, face.to, face.forward, face.backward);
    constexpr std::int64_t most = std::numeric_limits<std::int32_t>::max();
    for (Node n = 0; n < source_; ++n)
      if (terminals[n] > 0)
        body(source_, n, static_cast<std::int32_t>(std::min(terminals[n], most)), 0);
      else if (terminals[n] < 0)
        body(n, sink_, static_cast<std::int32_t>(std::min(-terminals[n], most)), 0);
  }

  std::vector<Arc> first_;
  std::vector<Node> head_, tail_;
  std::vector<Arc> opposite_;
  std::vector<std::int32_t> capacity_;
  Node source_, sink_;
};

// What Boost asks of a graph; found by argument-dependent look-up.
using NodeIterator = boost::counting_iterator<CutGraph::Node>;
using ArcIterator = boost::counting_iterator<CutGraph::Arc>;
CutGraph::Node source(CutGraph::Arc arc, const CutGraph& graph)
{
  return graph.Tail(arc);
}
CutGraph::Node target(CutGraph::Arc arc, const CutGraph& graph)
{
  return graph.Head(arc);
}
std::pair<NodeIterator, NodeIterator> vertices(const CutGraph& graph)
{
  return {NodeIterator(0), NodeIterator(static_cast<CutGraph::Node>(graph.NodeCount()))};
}
std::pair<ArcIterator, ArcIterator> edges(const CutGraph& graph)
{
  return {ArcIterator(0), ArcIterator(static_cast<CutGraph::Arc>(graph.ArcCount()))};
}
std::pair<ArcIterator, ArcIterator> out_edges(CutGraph::Node node, const CutGraph& graph)
{
  return {ArcIterator(graph.First(node)), ArcIterator(graph.End(node))};
}
CutGraph::Arc out_degree(CutGraph::Node node, const CutGraph& graph)
{
  return graph.End(node) - graph.First(node);
}
std::size_t num_vertices(const CutGraph& graph)
{
  return graph.NodeCount();
}
std::size_t num_edges(const CutGraph& graph)
{
  return graph.ArcCount();
}

} // namespace

} // namespace echorama

template <>
struct boost::graph_traits<echorama::CutGraph> {
  using vertex_descriptor = echorama::CutGraph::Node;
  using edge_descriptor = echorama::CutGraph::Arc;
  using vertex_iterator = echorama::NodeIterator;
  using edge_iterator = echorama::ArcIterator;
  using out_edge_iterator = echorama::ArcIterator;
  using directed_category = boost::directed_tag;
  using edge_parallel_category = boost::allow_parallel_edge_tag;
  struct traversal_category : boost::vertex_list_graph_tag, boost::edge_list_graph_tag, boost::incidence_graph_tag {};
  using vertices_size_type = std::size_t;
  using edges_size_type = std::size_t;
  using degree_size_type = echorama::CutGraph::Arc;
  static vertex_descriptor null_vertex() { return std::numeric_limits<vertex_descriptor>::max(); }
};

namespace echorama {

namespace {

// Boost sums flows in the type that capacities have: 32 bits are kept, 64 are summed.
struct Capacities {
  using key_type = CutGraph::Arc;
  using value_type = std::int64_t;
  using reference = std::int64_t;
  using category = boost::read_write_property_map_tag;
  std::int32_t* of;
};
std::int64_t get(const Capacities& capacities, CutGraph::Arc arc)
{
  return capacities.of[arc];
}
void put(const Capacities& capacities, CutGraph::Arc arc, std::int64_t value)
{
  capacities.of[arc] = static_cast<std::int32_t>(value);
}

// Whether each node is on the sink's side of the minimum cut; nodes that both sides could have stay with the source.
std::vector<bool> SinkSide(CutGraph& graph)
{
  const boost::typed_identity_property_map<std::uint32_t> index;
  const Capacities capacity{graph.Capacity().data()};
  std::vector<CutGraph::Arc> parent(graph.NodeCount());
  std::vector<boost::default_color_type> colour(graph.NodeCount());
  std::vector<std::int32_t> distance(graph.NodeCount());
  boost::boykov_kolmogorov_max_flow(
      graph, capacity, capacity, boost::make_iterator_property_map(graph.Opposite().begin(), index),
      boost::make_iterator_property_map(parent.begin(), index), boost::make_iterator_property_map(colour.begin(), index),
      boost::make_iterator_property_map(distance.begin(), index), index, graph.Source(), graph.Sink());
  std::vector<bool> sinkSide(graph.NodeCount());
  for (std::size_t n = 0; n < sinkSide.size(); ++n)
    sinkSide[n] = colour[n] == boost::default_color_type::white_color;
  return sinkSide;
}

using Voxel = std::array<int, 3>;
constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

// A voxel, or a block of voxels, that may take what a move offers or keep what it shows.
struct SeamChoice {
  Voxel at;
  std::array<std::uint32_t, 3> next{none, none, none}; // the choice at the next voxel along each axis
  std::array<std::int32_t, 3> ifNextTakes{0, 0, 0};    // what it costs if that one takes it and this one does not
  std::array<std::int32_t, 3> ifThisTakes{0, 0, 0};    // and the other way round
  std::int64_t taking = 0;                             // what taking costs more than keeping, whatever others do
};

// Sums of capacities stop here: far above all that a cut would cross, and twice it is still a capacity.
std::int32_t Capacity(std::int64_t sum)
{
  return static_cast<std::int32_t>(std::min<std::int64_t>(sum, 1 << 29));
}

// Cuts among the choices that are free, while the others stay with what they take. \return whether any changed
bool CutFree(const std::vector<SeamChoice>& choices, const std::vector<unsigned char>& free, std::vector<unsigned char>& takes)
{
  std::vector<std::uint32_t> number(choices.size(), none);
  std::uint32_t count = 0;
  for (std::size_t n = 0; n < choices.size(); ++n)
    if (free[n])
      number[n] = count++;
  if (count == 0)
    return false;
  std::vector<std::int64_t> terminals(count);
  std::vector<CutGraph::Face> faces;
  faces.reserve(std::size_t(3) * count);
  for (std::size_t n = 0; n < choices.size(); ++n) {
    const SeamChoice& choice = choices[n];
    if (free[n])
      terminals[number[n]] += choice.taking;
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t m = choice.next[axis];
      if (m == none)
        continue;
      if (free[n] && free[m])
        faces.push_back({number[n], number[m], choice.ifNextTakes[axis], choice.ifThisTakes[axis]});
      else if (free[n])
        terminals[number[n]] += takes[m] ? -choice.ifNextTakes[axis] : choice.ifThisTakes[axis];
      else if (free[m])
        terminals[number[m]] += takes[n] ? -choice.ifThisTakes[axis] : choice.ifNextTakes[axis];
    }
  }
  CutGraph graph(count, faces, terminals);
  const std::vector<bool> sinkSide = SinkSide(graph);
  bool changed = false;
  for (std::size_t n = 0; n < choices.size(); ++n)
    if (free[n] && takes[n] != sinkSide[number[n]]) {
      takes[n] = sinkSide[number[n]];
      changed = true;
    }
  return changed;
}

// Choices of blocks of two voxels along each axis; parents receives the block of each choice.
std::vector<SeamChoice> Blocks(const std::vector<SeamChoice>& choices, std::vector<std::uint32_t>& parents)
{
  Voxel lower = choices.front().at, upper = lower;
  for (const SeamChoice& choice : choices)
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], choice.at[axis] / 2);
      upper[axis] = std::max(upper[axis], choice.at[axis] / 2);
    }
  Volume<std::uint32_t> numbers({upper[0] - lower[0] + 1, upper[1] - lower[1] + 1, upper[2] - lower[2] + 1}, none);
  std::vector<SeamChoice> blocks;
  parents.resize(choices.size());
  for (std::size_t n = 0; n < choices.size(); ++n) {
    const Voxel at{choices[n].at[0] / 2, choices[n].at[1] / 2, choices[n].at[2] / 2};
    std::uint32_t& number = numbers.View()(at[0] - lower[0], at[1] - lower[1], at[2] - lower[2]);
    if (number == none) {
      number = static_cast<std::uint32_t>(blocks.size());
      blocks.emplace_back();
      blocks.back().at = at;
    }
    parents[n] = number;
  }
  for (std::size_t n = 0; n < choices.size(); ++n) {
    SeamChoice& block = blocks[parents[n]];
    block.taking += choices[n].taking;
    for (int axis = 0; axis < 3; ++axis) {
      const std::uint32_t m = choices[n].next[axis];
      if (m == none || parents[m] == parents[n])
        continue;
      block.next[axis] = parents[m];
      block.ifNextTakes[axis] = Capacity(std::int64_t(block.ifNextTakes[axis]) + choices[n].ifNextTakes[axis]);
      block.ifThisTakes[axis] = Capacity(std::int64_t(block.ifThisTakes[axis]) + choices[n].ifThisTakes[axis]);
    }
  }
  return blocks;
}

// The choices within some steps of where takers meet keepers, or of one that would rather be on the other side.
std::vector<unsigned char> Band(const std::vector<SeamChoice>& choices, const std::vector<unsigned char>& takes, int width)
{
  std::vector<unsigned char> band(choices.size(), 0), wider;
  for (std::size_t n = 0; n < choices.size(); ++n) {
    band[n] |= takes[n] ? choices[n].taking > 0 : choices[n].taking < 0;
    for (const std::uint32_t m : choices[n].next)
      if (m != none && takes[n] != takes[m])
        band[n] = band[m] = 1;
  }
  for (int step = 1; step < width; ++step) {
    wider = band;
    for (std::size_t n = 0; n < choices.size(); ++n)
      for (const std::uint32_t m : choices[n].next)
        if (m != none && band[n] != band[m])
          wider[n] = wider[m] = 1;
    band.swap(wider);
  }
  return band;
}

// Which choices take what is offered.
std::vector<unsigned char> Cut(const std::vector<SeamChoice>& choices, std::size_t exact, const Progress& progress)
{
  constexpr int bandWidth = 3, rounds = 4;
  std::vector<unsigned char> takes(choices.size(), 0);
  progress(0.0);
  std::vector<std::uint32_t> parents;
  std::vector<SeamChoice> blocks;
  if (choices.size() > exact)
    blocks = Blocks(choices, parents);
  // Dust does not become less in blocks, and need not: its flows are short.
  if (choices.size() <= exact || 4 * blocks.size() > 3 * choices.size()) {
    CutFree(choices, std::vector<unsigned char>(choices.size(), 1), takes);
    return takes;
  }
  const std::vector<unsigned char> coarse = Cut(blocks, exact, progress.Part(0.0, 0.3));
  for (std::size_t n = 0; n < choices.size(); ++n)
    takes[n] = coarse[parents[n]];
  for (int round = 0; round < rounds; ++round) {
    progress(0.3 + 0.7 * round / rounds);
    if (!CutFree(choices, Band(choices, takes, bandWidth), takes))
      break;
  }
  return takes;
}

using Labels = Volume<unsigned short>;

void CheckVolumes(const std::vector<CoarseVolume>& volumes, const std::array<int, 3>& dimensions)
{
  if (volumes.size() >= noVolume)
    throw Error(Error::Kind::InvalidParameter, "seams: at most 65534 volumes have labels");
  const GridBox grid{{0, 0, 0}, dimensions};
  for (const CoarseVolume& volume : volumes)
    if (!volume.inside.box.Empty() && volume.inside.box.Intersected(grid).VoxelCount() != volume.inside.box.VoxelCount())
      throw Error(Error::Kind::InvalidParameter, "seams: the box of a volume must lie within the grid");
}

// scale or trust of the voxels of a row; 1 where it is not known at all, 0 for what is not a number.
float At(const Boxed<float>& field, int i, int j, int k)
{
  if (field.box.Empty())
    return 1.0f;
  const float value = field.Row(j, k)[i - field.box.first[0]];
  return value > 0.0f ? value : 0.0f;
}

class Seams {
public:
  Seams(const std::vector<CoarseVolume>& volumes, const std::array<int, 3>& dimensions, const SeamParameters& parameters,
        const Progress& progress)
    : volumes_(volumes), parameters_(parameters), labels_(dimensions, noVolume)
  {
    FindChoices(progress.Part(0.0, 0.5));
    unit_ = MedianDifference(progress.Part(0.5, 1.0));
  }

  // Offers a volume to all voxels that may show it. \return whether any voxel took it
  bool Move(int volume, const Progress& progress);
  Labels Take() { return std::move(labels_); }

private:
  static constexpr double steps = 64.0; // of cost per unit

  bool Inside(int volume, const Voxel& at) const
  {
    const Boxed<unsigned char>& inside = volumes_[volume].inside;
    return inside.box.HasRow(at[1], at[2]) && at[0] >= inside.box.first[0] && at[0] < inside.box.first[0] + inside.box.size[0] &&
           (inside.Row(at[1], at[2])[at[0] - inside.box.first[0]] & 1);
  }

  // What volumes differ at a voxel where both are.
  std::int64_t Difference(int a, int b, const Voxel& at) const
  {
    const Boxed<float>&first = volumes_[a].value, &second = volumes_[b].value;
    const double difference = std::abs(static_cast<double>(first.Row(at[1], at[2])[at[0] - first.box.first[0]]) -
                                       second.Row(at[1], at[2])[at[0] - second.box.first[0]]) /
                              unit_;
    return std::llround(steps * (difference < parameters_.ceiling ? difference : parameters_.ceiling));
  }

  // The cost of showing a at p and b at q, which are neighbours; a is at p, and b at q.
  std::int64_t FaceCost(int a, const Voxel& p, int b, const Voxel& q) const
  {
    if (a == b)
      return 0;
    std::int64_t cost = std::llround(steps * parameters_.length);
    const std::int64_t border = std::llround(steps * parameters_.border);
    cost += Inside(b, p) ? Difference(a, b, p) : border;
    cost += Inside(a, q) ? Difference(a, b, q) : border;
    return cost;
  }

  void FindChoices(const Progress& progress);
  double MedianDifference(const Progress& progress) const;

  const std::vector<CoarseVolume>& volumes_;
  const SeamParameters parameters_;
  Labels labels_;
  std::vector<Boxed<unsigned char>> shown_; // 1 where a volume may be shown
  double unit_ = 1.0;
};

void Seams::FindChoices(const Progress& progress)
{
  const std::array<int, 3>& n = labels_.Dimensions();
  for (const CoarseVolume& volume : volumes_)
    shown_.push_back({volume.inside.box, Volume<unsigned char>(volume.inside.box.size)});
  ForRows({{0, 0, 0}, n}, progress, [&](int j, int k) {
    std::vector<float> best(n[0], 0.0f);
    std::vector<int> cores(n[0], 0);
    const auto forInside = [&](const auto& body) {
      for (std::size_t v = 0; v < volumes_.size(); ++v) {
        const Boxed<unsigned char>& inside = volumes_[v].inside;
        if (!inside.box.HasRow(j, k))
          continue;
        const unsigned char* row = inside.Row(j, k);
        unsigned char* shown = shown_[v].Row(j, k);
        for (int i = 0; i < inside.box.size[0]; ++i)
          if (row[i] & 1)
            body(volumes_[v], inside.box.first[0] + i, shown[i]);
      }
    };
    const auto trusted = [&](const CoarseVolume& volume, int i) {
      return At(volume.trust, i, j, k) >= static_cast<float>(parameters_.shadow) * best[i];
    };
    forInside([&](const CoarseVolume& volume, int i, unsigned char&) { best[i] = std::max(best[i], At(volume.trust, i, j, k)); });
    const auto isCore = [&](const CoarseVolume& volume, int i) {
      return !volume.scale.box.Empty() && At(volume.scale, i, j, k) >= 1.0f;
    };
    forInside([&](const CoarseVolume& volume, int i, unsigned char& shown) {
      shown = trusted(volume, i);
      cores[i] += shown && isCore(volume, i);
    });
    forInside(
        [&](const CoarseVolume& volume, int i, unsigned char& shown) { shown = shown && (cores[i] != 1 || isCore(volume, i)); });
  });
}

double Seams::MedianDifference(const Progress& progress) const
{
  // Some voxels of each pair are enough; which ones follows from the boxes alone.
  constexpr std::size_t samples = 20000;
  std::vector<double> differences;
  for (std::size_t a = 0; a < volumes_.size(); ++a) {
    progress(static_cast<double>(a) / static_cast<double>(volumes_.size()));
    for (std::size_t b = a + 1; b < volumes_.size(); ++b) {
      const GridBox both = volumes_[a].inside.box.Intersected(volumes_[b].inside.box);
      const std::size_t count = both.VoxelCount();
      const std::size_t step = count / samples | 1; // odd: no column of a box of even size is read again and again
      for (std::size_t n = 0; n < count; n += step) {
        const std::size_t row = n / both.size[0];
        const Voxel at{both.first[0] + static_cast<int>(n % both.size[0]), both.first[1] + static_cast<int>(row % both.size[1]),
                       both.first[2] + static_cast<int>(row / both.size[1])};
        if (!Inside(static_cast<int>(a), at) || !Inside(static_cast<int>(b), at))
          continue;
        const Boxed<float>&first = volumes_[a].value, &second = volumes_[b].value;
        const double difference = std::abs(static_cast<double>(first.Row(at[1], at[2])[at[0] - first.box.first[0]]) -
                                           second.Row(at[1], at[2])[at[0] - second.box.first[0]]);
        if (std::isfinite(difference) && difference > 0.0) // where volumes are equal there is nothing to compare with
          differences.push_back(difference);
      }
    }
  }
  if (differences.empty())
    return 1.0;
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  return *middle;
}

bool Seams::Move(int volume, const Progress& progress)
{
  const GridBox& box = shown_[volume].box;
  if (box.Empty())
    return false;
  // 1. Nodes, numbered row by row. Where nothing is shown yet there is no choice.
  Boxed<std::uint32_t> numbers{box, Volume<std::uint32_t>(box.size, none)};
  std::vector<std::uint32_t> nodesOfRow(static_cast<std::size_t>(box.size[1]) * box.size[2] + 1, 0);
  std::vector<unsigned char> filled(nodesOfRow.size(), 0);
  const auto rowNumber = [&](int j, int k) {
    return static_cast<std::size_t>(k - box.first[2]) * box.size[1] + (j - box.first[1]);
  };
  const auto own = static_cast<unsigned short>(volume);
  ForRows(box, progress.Part(0.0, 0.05), [&](int j, int k) {
    const unsigned char* shown = shown_[volume].Row(j, k);
    unsigned short* label = labels_.View().Row(j, k) + box.first[0];
    std::uint32_t count = 0;
    for (int i = 0; i < box.size[0]; ++i)
      if (shown[i] && label[i] == noVolume) {
        label[i] = own;
        filled[rowNumber(j, k)] = 1;
      } else if (shown[i] && label[i] != own)
        ++count;
    nodesOfRow[rowNumber(j, k) + 1] = count;
  });
  bool changed = std::find(filled.begin(), filled.end(), 1) != filled.end();
  for (std::size_t row = 1; row < nodesOfRow.size(); ++row)
    nodesOfRow[row] += nodesOfRow[row - 1];
  const std::size_t nodes = nodesOfRow.back();
  if (nodes == 0)
    return changed;
  ForRows(box, progress.Part(0.05, 0.1), [&](int j, int k) {
    const unsigned char* shown = shown_[volume].Row(j, k);
    const unsigned short* label = labels_.View().Row(j, k) + box.first[0];
    std::uint32_t* number = numbers.Row(j, k);
    std::uint32_t next = nodesOfRow[rowNumber(j, k)];
    for (int i = 0; i < box.size[0]; ++i)
      if (shown[i] && label[i] != own)
        number[i] = next++;
  });
  // 2. Faces, each once, from the choice at its lower end; and what faces to voxels without a choice cost either way.
  std::vector<SeamChoice> choices(nodes);
  const auto labels = labels_.View();
  const auto numberOf = [&](const Voxel& at) {
    return box.HasRow(at[1], at[2]) && at[0] >= box.first[0] && at[0] < box.first[0] + box.size[0]
               ? numbers.Row(at[1], at[2])[at[0] - box.first[0]]
               : none;
  };
  for (int k = box.first[2]; k < box.first[2] + box.size[2]; ++k) {
    progress(0.1 + 0.2 * (k - box.first[2]) / box.size[2]);
    for (int j = box.first[1]; j < box.first[1] + box.size[1]; ++j)
      for (int i = box.first[0]; i < box.first[0] + box.size[0]; ++i) {
        const Voxel p{i, j, k};
        const std::uint32_t node = numberOf(p);
        if (node == none)
          continue;
        SeamChoice& choice = choices[node];
        choice.at = p;
        const int a = labels(i, j, k);
        for (int axis = 0; axis < 3; ++axis)
          for (const int side : {-1, 1}) {
            Voxel q = p;
            q[axis] += side;
            if (q[axis] < 0 || q[axis] >= labels_.Dimensions()[axis])
              continue;
            const int b = labels(q[0], q[1], q[2]);
            if (b == noVolume)
              continue;
            const std::uint32_t other = numberOf(q);
            if (other == none) {
              choice.taking += FaceCost(volume, p, b, q) - FaceCost(a, p, b, q);
              continue;
            }
            if (side < 0)
              continue;
            // Costs by (p takes it, q takes it); half of what both save by leaving the present seam goes to each.
            const std::int64_t neither = FaceCost(a, p, b, q);
            const std::int64_t second = FaceCost(a, p, volume, q), first = FaceCost(volume, p, b, q);
            std::int64_t forP = -(neither / 2), forQ = -neither - forP;
            std::int64_t forward = second - neither - forQ, backward = first - neither - forP;
            // Roundings may miss the metric by one.
            const std::int64_t lack = std::max<std::int64_t>(0, -(forward + backward));
            forward += lack;
            if (forward < 0) {
              backward += forward;
              forQ += forward;
              forP -= forward;
              forward = 0;
            } else if (backward < 0) {
              forward += backward;
              forP += backward;
              forQ -= backward;
              backward = 0;
            }
            choice.taking += forP;
            choices[other].taking += forQ;
            choice.next[axis] = other;
            choice.ifNextTakes[axis] = Capacity(forward);
            choice.ifThisTakes[axis] = Capacity(backward);
          }
      }
  }
  // 3. The cut.
  const std::vector<unsigned char> takes = Cut(choices, static_cast<std::size_t>(parameters_.atOnce), progress.Part(0.3, 0.95));
  // 4. Labels.
  for (int k = box.first[2]; k < box.first[2] + box.size[2]; ++k)
    for (int j = box.first[1]; j < box.first[1] + box.size[1]; ++j) {
      const std::uint32_t* number = numbers.Row(j, k);
      unsigned short* label = labels_.View().Row(j, k) + box.first[0];
      for (int i = 0; i < box.size[0]; ++i)
        if (number[i] != none && takes[number[i]]) {
          label[i] = own;
          changed = true;
        }
    }
  return changed;
}

} // namespace

Volume<unsigned short> CutSeams(const std::vector<CoarseVolume>& volumes, const std::array<int, 3>& dimensions,
                                const SeamParameters& parameters, const Progress& progress)
{
  const auto check = [](bool good, const char* message) {
    if (!good)
      throw Error(Error::Kind::InvalidParameter, message);
  };
  check(parameters.length >= 0.0 && parameters.length <= 1e4, "seams: length must be in [0, 10000]");
  check(parameters.ceiling > 0.0 && parameters.ceiling <= 1e4, "seams: ceiling must be in (0, 10000]");
  check(parameters.border >= 0.0 && parameters.border <= 1e4, "seams: border must be in [0, 10000]");
  check(parameters.shadow >= 0.0 && parameters.shadow <= 1.0, "seams: shadow must be in [0, 1]");
  check(parameters.sweeps >= 1, "seams: sweeps must be at least 1");
  check(parameters.atOnce >= 1, "seams: atOnce must be at least 1");
  CheckVolumes(volumes, dimensions);
  Seams seams(volumes, dimensions, parameters, progress.Part(0.0, 0.1));
  const int count = static_cast<int>(volumes.size());
  const int sweeps = count > 2 ? parameters.sweeps : 1;
  // A sweep ends the work when none of its moves, nor any since, changed anything.
  int idle = 0, moves = 0;
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (int v = 0; v < count && idle < count; ++v, ++moves) {
      const double all = static_cast<double>(sweeps) * count;
      idle = seams.Move(v, progress.Part(0.1 + 0.9 * moves / all, 0.1 + 0.9 * (moves + 1) / all)) ? 0 : idle + 1;
    }
  progress(1.0);
  return seams.Take();
}

} // namespace echorama
