// SPDX-License-Identifier: BSD-3-Clause
#include "ParameterPanel.h"
#include "Controls.h"
#include "Core/Base/NumberText.h"
#include <algorithm>
#include <cmath>
#include <QCheckBox>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QFormLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QSignalBlocker>
#include <QSlider>

namespace echorama {

namespace {

constexpr int SliderSteps = 200;

bool Matters(const Parameter& parameter, const std::string& onlyWhen, ParameterList& all)
{
  if (parameter.whenName.empty())
    return true;
  const Parameter* other = Find(all, parameter.whenName);
  if (!other)
    return true;
  const std::string now = other->Text();
  return (onlyWhen.empty() || now == onlyWhen) &&
         std::find(parameter.whenValues.begin(), parameter.whenValues.end(), now) != parameter.whenValues.end();
}

} // namespace

ParameterPanel::ParameterPanel(Source source, const std::vector<Control>& controls,
                               std::function<void(const char*, const std::string&)> set, QWidget* parent)
  : QWidget(parent), source_(std::move(source)), set_(std::move(set))
{
  auto* form = new QFormLayout(this);
  form->setContentsMargins(4, 4, 4, 4);
  form->setVerticalSpacing(3);
  ParameterList parameters = source_();
  for (const Control& control : controls) {
    const Parameter& parameter = Named(parameters, control.name);
    QWidget* field = MakeField(parameter, control);
    auto* label = new QLabel(control.label, this);
    label->setToolTip(QString::fromStdString(parameter.help));
    form->addRow(label, field);
    shows_.push_back([field, label, key = parameter.name, onlyWhen = std::string(control.onlyWhen)](ParameterList& all) {
      const bool matters = Matters(Named(all, key), onlyWhen, all);
      field->setEnabled(matters);
      label->setEnabled(matters);
    });
  }
  ShowValues();
}

void ParameterPanel::Set(const Parameter& parameter, const std::string& text)
{
  set_(parameter.name.c_str(), text);
  ShowValues();
}

void ParameterPanel::ShowValues()
{
  ParameterList now = source_();
  for (const auto& show : shows_)
    show(now);
}

QWidget* ParameterPanel::MakeField(const Parameter& parameter, const Control& control)
{
  const QString help = QString::fromStdString(parameter.help);
  const std::string key = parameter.name;
  if (std::holds_alternative<bool*>(parameter.value)) {
    auto* field = CheckField(this, key.c_str(), {}, help, [this, parameter](bool on) { Set(parameter, on ? "on" : "off"); });
    shows_.push_back([field, key](ParameterList& all) { Show(field, Named(all, key).Number() != 0.0); });
    return field;
  }
  if (const auto* choice = std::get_if<Choice>(&parameter.value)) {
    QVector<WordChoice> words;
    for (const std::string& name : choice->names)
      words.append({QString::fromStdString(name), QString::fromStdString(name)});
    auto* field = ChoiceField(this, key.c_str(), help, words,
                              [this, parameter](const QString& word) { Set(parameter, word.toStdString()); });
    shows_.push_back([field, key](ParameterList& all) { Show(field, QString::fromStdString(Named(all, key).Text())); });
    return field;
  }
  return MakeNumber(parameter, control);
}

QWidget* ParameterPanel::MakeNumber(const Parameter& parameter, const Control& control)
{
  const std::string key = parameter.name;
  const QString help = QString::fromStdString(parameter.help);
  const bool isWhole = !std::holds_alternative<double*>(parameter.value);
  const bool isWide = control.low == control.high;
  const double low = isWide ? parameter.range.low : control.low, high = isWide ? parameter.range.high : control.high;
  const double step = isWhole ? 1.0 : std::pow(10.0, std::floor(std::log10((high - low) / 20.0)));
  const int digits = isWhole ? 0 : std::max(0, static_cast<int>(-std::floor(std::log10(step))));
  auto* both = new QWidget(this);
  auto* row = new QHBoxLayout(both);
  row->setContentsMargins(0, 0, 0, 0);
  auto* slider = new QSlider(Qt::Horizontal, both);
  slider->setObjectName(QString::fromStdString(key + "Slider"));
  slider->setToolTip(help);
  slider->setRange(0, isWhole ? static_cast<int>(high - low) : SliderSteps);
  slider->setMinimumWidth(60);
  const double perStep = (high - low) / std::max(1, slider->maximum());
  const QString named = control.unit.isEmpty() ? QString::fromStdString(parameter.unit) : control.unit;
  const QString unit = named.isEmpty() ? QString() : " " + named;
  auto* number = NumberField(
      both, {key.c_str(), help, std::max(parameter.range.low, -1e9), std::min(parameter.range.high, 1e9), digits, step, unit},
      [this, parameter](double typed) { Set(parameter, NumberText(typed)); });
  number->setSpecialValueText(control.least);
  row->addWidget(slider, 1);
  row->addWidget(number);
  connect(slider, &QSlider::valueChanged, this,
          [this, parameter, low, perStep](int at) { Set(parameter, NumberText(low + at * perStep)); });
  shows_.push_back([slider, number, key, low, perStep](ParameterList& all) {
    const double now = Named(all, key).Number();
    Show(number, now);
    const QSignalBlocker quiet(slider);
    slider->setValue(static_cast<int>(std::lround((now - low) / perStep)));
  });
  return both;
}

} // namespace echorama
