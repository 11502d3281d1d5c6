// SPDX-License-Identifier: BSD-3-Clause
#include "vtkUltrasoundTissueMeshes.h"

#include "Core/Base/Error.h"
#include "Core/Base/NumberText.h"
#include "Filters/Tissue/SurfaceCheck.h"
#include "vtkCellArray.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataObjectTree.h"
#include "vtkDataObjectTreeIterator.h"
#include "vtkDoubleArray.h"
#include "vtkFieldData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkIntArray.h"
#include "vtkMath.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSmartPointer.h"
#include "vtkStringArray.h"
#include "vtkUltrasoundTissue.h"
#include "vtkUltrasoundTriangles.h"
#include "vtkUltrasoundVolume.h"

#include <algorithm>
#include <array>
#include <vector>

using echorama::Error;
using echorama::SurfaceFault;
using echorama::SurfaceReport;
using echorama::TissueSurface;
using echorama::TriangleSurface;

vtkStandardNewMacro(vtkUltrasoundTissueMeshes);

namespace {

enum class MeshAxes { LPS, YUp, RAS };

// A body to be: a material and the blocks that bound it together.
struct Body {
  std::string Material;
  std::vector<std::size_t> Blocks;
  std::string Name;
};

// What came in at one connection.
struct Input {
  std::vector<vtkPolyData*> Blocks; // with polygons, or tissue
  std::vector<std::string> Names;   // of the blocks, may be empty

  // Whether a body is tissue as it is. That cannot be one of several blocks.
  bool IsTissue(const Body& body) const
  {
    const auto is = [this](std::size_t block) { return vtkUltrasoundTissue::IsTissue(this->Blocks[block]); };
    const bool any = std::any_of(body.Blocks.begin(), body.Blocks.end(), is);
    if (any && body.Blocks.size() > 1) {
      throw Error(Error::Kind::InvalidParameter, "Materials: \"" + body.Name + "\" has a block that is tissue already");
    }
    return any;
  }
};

// Blocks without a name have that of the nearest one above, as in GLTF.
void AddBlocks(vtkDataObject* data, const std::string& name, Input& input)
{
  vtkPolyData* block = vtkPolyData::SafeDownCast(data);
  if (block && (block->GetNumberOfPolys() + block->GetNumberOfStrips() > 0 || vtkUltrasoundTissue::IsTissue(block))) {
    input.Blocks.push_back(block);
    input.Names.push_back(name);
  }
  if (vtkDataObjectTree* tree = vtkDataObjectTree::SafeDownCast(data)) {
    const auto node = vtkSmartPointer<vtkDataObjectTreeIterator>::Take(tree->NewTreeIterator());
    node->VisitOnlyLeavesOff();
    node->TraverseSubTreeOff();
    for (node->InitTraversal(); !node->IsDoneWithTraversal(); node->GoToNextItem()) {
      const char* own = node->HasCurrentMetaData() ? node->GetCurrentMetaData()->Get(vtkCompositeDataSet::NAME()) : nullptr;
      AddBlocks(node->GetCurrentDataObject(), own && *own ? own : name, input);
    }
  }
}

Input BlocksOf(vtkDataObject* data)
{
  Input input;
  AddBlocks(data, "", input);
  return input;
}

std::string Trimmed(const std::string& text)
{
  const auto first = text.find_first_not_of(" \t\n");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\n") - first + 1);
}

// The parts of a text between separators that stand outside of brackets.
std::vector<std::string> Split(const std::string& text, char separator)
{
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : text) {
    depth += c == '[' ? 1 : c == ']' ? -1 : 0;
    if (c == separator && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  for (std::string& part : parts) {
    part = Trimmed(part);
  }
  return parts;
}

// "0-3,7" or "*".
std::vector<std::size_t> NumbersFrom(const std::string& text, std::size_t count, const std::string& whole)
{
  std::vector<std::size_t> numbers;
  for (const std::string& part : Split(text, ',')) {
    const std::vector<std::string> ends = Split(part, '-');
    std::size_t first = 0, last = count - 1;
    if (part != "*" && (ends.size() > 2 || !echorama::ParseNumber(ends.front(), first) ||
                        !echorama::ParseNumber(ends.back(), last) || first > last)) {
      throw Error(Error::Kind::InvalidParameter,
                  "Materials: \"" + whole + "\" is not a material with blocks like [0-3,7] or [*] after it");
    }
    if (last >= count) {
      throw Error(Error::Kind::InvalidParameter, "Materials: \"" + whole + "\" names block " + std::to_string(last) +
                                                     "; the input has " + std::to_string(count) + ", counted from 0");
    }
    for (std::size_t number = first; number <= last; ++number) {
      numbers.push_back(number);
    }
  }
  return numbers;
}

// The bodies that an input becomes, after its entry in Materials.
std::vector<Body> BodiesOf(const std::string& entry, const Input& input)
{
  std::vector<Body> bodies;
  if (entry.find_first_of("[+") == std::string::npos) {
    echorama::StandardMaterial(entry); // throws before there is any work
    for (std::size_t block = 0; block < input.Blocks.size(); ++block) {
      bodies.push_back({entry, {block}, Trimmed(entry + " " + input.Names[block])});
    }
    return bodies;
  }
  for (const std::string& term : Split(entry, '+')) {
    const auto open = term.find('[');
    if (open == std::string::npos || term.back() != ']') {
      throw Error(Error::Kind::InvalidParameter,
                  "Materials: \"" + term + "\" is not a material with blocks like [0-3,7] or [*] after it");
    }
    const std::string material = Trimmed(term.substr(0, open));
    echorama::StandardMaterial(material);
    bodies.push_back({material, NumbersFrom(term.substr(open + 1, term.size() - open - 2), input.Blocks.size(), term), term});
  }
  return bodies;
}

// Into mm and LPS.
Eigen::Affine3d ToPatient(double scale, MeshAxes axes)
{
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  if (axes == MeshAxes::YUp) {
    map.linear() << 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0;
  } else if (axes == MeshAxes::RAS) {
    map.linear().diagonal() << -1.0, -1.0, 1.0;
  }
  map.linear() *= scale;
  return map;
}

std::array<const SurfaceFault*, 6> FaultsOf(const SurfaceReport& report)
{
  return {&report.openEdges, &report.crowdedEdges,      &report.inconsistentEdges,
          &report.insideOut, &report.selfIntersections, &report.degenerateTriangles};
}

// What is known of the surface of a body.
struct Findings {
  SurfaceReport Report; // as it came, but welded
  std::string Text;
};

// Welds, checks, turns and closes a surface.
Findings Mend(TriangleSurface& surface, const echorama::SurfaceMendParameters& mend,
              const echorama::SurfaceCheckParameters& check, const echorama::Progress& progress)
{
  const auto welded = echorama::MendSurface(surface, {mend.weldMm, false, false}, progress.Part(0.0, 0.2));
  Findings findings{echorama::CheckSurface(surface, check, progress.Part(0.2, 0.9)), ""};
  const auto mended = echorama::MendSurface(surface, {0.0, mend.orient, mend.closeHoles}, progress.Part(0.9, 1.0));
  findings.Report.volumeMm3 = 0.0;
  for (const auto& [a, b, c] : surface.triangles) {
    const Eigen::Vector3d p = surface.points[a].cast<double>(), q = surface.points[b].cast<double>();
    findings.Report.volumeMm3 += p.dot(q.cross(surface.points[c].cast<double>())) / 6.0;
  }
  findings.Text = findings.Report.Faults();
  const auto add = [&findings](std::int64_t count, const char* one, const char* many) {
    if (count > 0) {
      findings.Text += (findings.Text.empty() ? "" : "; ") + std::to_string(count) + (count == 1 ? one : many);
    }
  };
  add(welded.droppedTriangles, " triangle without area left out", " triangles without area left out");
  add(mended.turnedTriangles, " triangle turned", " triangles turned");
  add(mended.closedHoles, " hole closed", " holes closed");
  return findings;
}

// The bodies that are done, and what was found.
class Collection {
public:
  explicit Collection(const echorama::Material& background)
  {
    this->Tissue.MaterialIndex(background);
    this->Faults->SetName("SurfaceFaults");
    this->Faults->SetNumberOfComponents(6);
    this->Volumes->SetName("SurfaceVolume");
    this->Texts->SetName("SurfaceReport");
    this->PlaceFault->SetName("Fault");
    this->PlaceBody->SetName("Body");
  }

  // Tissue that was made elsewhere, and is not checked.
  void Keep(const TissueSurface& tissue)
  {
    this->Tissue.Append(tissue);
    for (std::size_t i = 0; i < tissue.bodies.size(); ++i) {
      this->Faults->InsertNextTuple6(0, 0, 0, 0, 0, 0);
      this->Volumes->InsertNextValue(vtkMath::Nan());
      this->Texts->InsertNextValue("");
    }
  }

  void Add(const Body& chosen, TriangleSurface&& surface, const Findings& findings)
  {
    TissueSurface body;
    body.MaterialIndex(echorama::StandardMaterial(chosen.Material));
    body.bodies.push_back({chosen.Name, 0});
    body.points = std::move(surface.points);
    body.triangles = std::move(surface.triangles);
    body.bodyOfTriangle.assign(body.triangles.size(), 0);
    this->Tissue.Append(body);

    const int index = static_cast<int>(this->Tissue.bodies.size()) - 1;
    const auto kinds = FaultsOf(findings.Report);
    std::array<double, 6> counts;
    for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
      counts[kind] = static_cast<double>(std::min<std::int64_t>(kinds[kind]->count, VTK_INT_MAX));
      for (const Eigen::Vector3f& place : kinds[kind]->places) {
        const vtkIdType id = this->Places->InsertNextPoint(place.data());
        this->Vertices->InsertNextCell(1, &id);
        this->PlaceFault->InsertNextValue(static_cast<int>(kind));
        this->PlaceBody->InsertNextValue(index);
      }
    }
    this->Faults->InsertNextTuple(counts.data());
    this->Volumes->InsertNextValue(findings.Report.volumeMm3);
    this->Texts->InsertNextValue(findings.Text);
    if (!findings.Text.empty()) {
      this->Report += "body " + std::to_string(index) + " (" + chosen.Name + "): " + findings.Text + "\n";
    }
    this->FaultyBodies += !findings.Report.IsSound();
  }

  void Write(vtkPolyData* tissue, vtkPolyData* places) const
  {
    vtkUltrasoundTissue::Set(tissue, this->Tissue);
    tissue->GetFieldData()->AddArray(this->Faults);
    tissue->GetFieldData()->AddArray(this->Volumes);
    tissue->GetFieldData()->AddArray(this->Texts);
    places->SetPoints(this->Places);
    places->SetVerts(this->Vertices);
    places->GetPointData()->AddArray(this->PlaceFault);
    places->GetPointData()->AddArray(this->PlaceBody);
    places->GetPointData()->SetActiveScalars("Fault");
  }

  std::string Report;
  int FaultyBodies = 0;

private:
  TissueSurface Tissue;
  vtkNew<vtkIntArray> Faults, PlaceFault, PlaceBody;
  vtkNew<vtkDoubleArray> Volumes;
  vtkNew<vtkStringArray> Texts;
  vtkNew<vtkPoints> Places;
  vtkNew<vtkCellArray> Vertices;
};

} // namespace

vtkUltrasoundParametersMacro(vtkUltrasoundTissueMeshes);

struct vtkUltrasoundTissueMeshes::Settings {
  std::string materials = "tissue", background = "tissue";
  double scale = 1.0;
  MeshAxes axes = MeshAxes::LPS;
  echorama::SurfaceMendParameters mend;
  echorama::SurfaceCheckParameters check;
};

//----------------------------------------------------------------------------
echorama::ParameterList vtkUltrasoundTissueMeshes::Parameters()
{
  using echorama::Parameter;
  Settings& v = *this->Values;
  return echorama::Join(
      {{Parameter(
            "Materials", v.materials,
            "What each input is made of, in their order, separated by commas; the last holds for all further inputs. Either "
            "the name of a standard material: each block of polygons is a body. Or bodies of chosen blocks, joined by plus "
            "signs: liver[10-19], or kidney[0] + lesion-dark[2], or spleen[*] for all; blocks are counted from 0. The "
            "blocks of one body are welded into one surface: organs often come in patches."),
        Parameter("Background", v.background, "The standard material around all bodies."),
        Parameter("Scale", v.scale, {1e-6, 1e6}, "mm", "One unit of the inputs: 1000 for metres, as in GLTF."),
        Parameter(
            "Axes", echorama::Choice(v.axes, {"LPS", "y-up", "RAS"}),
            "The axes of the inputs. LPS: as they are. Y up: x left, y up, z to the front, of a patient who stands upright, "
            "as in GLTF. RAS: as in 3D Slicer's world.")},
       Describe(v.mend),
       Without(Describe(v.check), {"MostPlaces"})});
}

//----------------------------------------------------------------------------
vtkUltrasoundTissueMeshes::vtkUltrasoundTissueMeshes() : Values(new Settings)
{
  this->SetNumberOfOutputPorts(2);
}

//----------------------------------------------------------------------------
vtkUltrasoundTissueMeshes::~vtkUltrasoundTissueMeshes() = default;

//----------------------------------------------------------------------------
int vtkUltrasoundTissueMeshes::FillInputPortInformation(int, vtkInformation* info)
{
  // The tree comes first: the pipeline looks there to see that composite data is wanted whole, not leaf by leaf.
  info->Set(INPUT_REQUIRED_DATA_TYPE(), "vtkDataObjectTree");
  info->Append(INPUT_REQUIRED_DATA_TYPE(), "vtkPolyData");
  info->Set(INPUT_IS_REPEATABLE(), 1);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundTissueMeshes::RequestUpdateExtent(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector*)
{
  vtkUltrasoundVolume::RequestWhole(inputs[0]);
  return 1;
}

//----------------------------------------------------------------------------
int vtkUltrasoundTissueMeshes::RequestData(vtkInformation*, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  this->Report.clear();
  this->NumberOfFaultyBodies = 0;
  return vtkUltrasoundVolume::Run(this, outputs, [this, inputs, outputs](const echorama::Progress& progress) {
    echorama::CheckRanges(this->Parameters());
    const Settings& v = *this->Values;
    std::vector<Input> given;
    std::size_t blocks = 0;
    for (int connection = 0; connection < inputs[0]->GetNumberOfInformationObjects(); ++connection) {
      given.push_back(BlocksOf(vtkDataObject::GetData(inputs[0], connection)));
      blocks += given.back().Blocks.size();
    }
    if (blocks == 0) {
      throw Error(Error::Kind::BadInput, "no input has polygons");
    }
    const std::vector<std::string> entries = Split(v.materials, ',');
    const auto part = [](const echorama::Progress& whole, std::size_t which, std::size_t count) {
      return whole.Part(static_cast<double>(which) / static_cast<double>(count),
                        static_cast<double>(which + 1) / static_cast<double>(count));
    };

    Collection collection(echorama::StandardMaterial(v.background));
    for (std::size_t i = 0; i < given.size(); ++i) {
      const std::vector<Body> bodies = BodiesOf(entries[std::min(i, entries.size() - 1)], given[i]);
      for (std::size_t j = 0; j < bodies.size(); ++j) {
        if (given[i].IsTissue(bodies[j])) {
          collection.Keep(vtkUltrasoundTissue::Of(given[i].Blocks[bodies[j].Blocks.front()]));
          continue;
        }
        TriangleSurface surface;
        for (const std::size_t block : bodies[j].Blocks) {
          echorama::AddTriangles(surface, given[i].Blocks[block], ToPatient(v.scale, v.axes));
        }
        const Findings findings = Mend(surface, v.mend, v.check, part(part(progress, i, given.size()), j, bodies.size()));
        collection.Add(bodies[j], std::move(surface), findings);
      }
    }
    collection.Write(vtkPolyData::GetData(outputs, 0), vtkPolyData::GetData(outputs, 1));
    this->Report = collection.Report;
    this->NumberOfFaultyBodies = collection.FaultyBodies;
  });
}

//----------------------------------------------------------------------------
void vtkUltrasoundTissueMeshes::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  vtkUltrasoundParameters::Print(os, indent, this->Parameters());
  os << indent << "NumberOfFaultyBodies: " << this->NumberOfFaultyBodies << "\n";
  os << indent << "Report: " << this->Report << "\n";
}
