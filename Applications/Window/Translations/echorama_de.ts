<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE TS>
<TS version="2.1" language="de" sourcelanguage="en">
<context>
    <name>Preferences</name>
    <message>
        <source>Seven tints</source>
        <translation>Sieben Farbtöne</translation>
    </message>
    <message>
        <source>Grey and amber</source>
        <translation>Grau und Bernstein</translation>
    </message>
    <message>
        <source>Blue and orange</source>
        <translation>Blau und Orange</translation>
    </message>
    <message>
        <source>Dark</source>
        <translation>Dunkel</translation>
    </message>
    <message>
        <source>Light</source>
        <translation>Hell</translation>
    </message>
    <message>
        <source>As the system</source>
        <translation>Wie das System</translation>
    </message>
    <message>
        <source>Preferences</source>
        <translation>Einstellungen</translation>
    </message>
    <message>
        <source>&amp;Colours of volumes</source>
        <translation>&amp;Farben der Volumen</translation>
    </message>
    <message>
        <source>The last two can also be told apart by people who see no red or no green</source>
        <translation>Die letzten beiden unterscheidet auch, wer kein Rot oder kein Grün sieht</translation>
    </message>
    <message>
        <source>&amp;Window</source>
        <translation>&amp;Fenster</translation>
    </message>
    <message>
        <source>Dark grey changes least how grey levels look; pictures stay on black in any</source>
        <translation>Dunkelgrau verändert am wenigsten, wie Grauwerte wirken; Bilder bleiben immer auf Schwarz</translation>
    </message>
    <message>
        <source>&amp;Language</source>
        <translation>&amp;Sprache</translation>
    </message>
    <message>
        <source>Texts are in this language from the next start</source>
        <translation>Texte sind ab dem nächsten Start in dieser Sprache</translation>
    </message>
    <message>
        <source>The language changes when the workbench is started again.</source>
        <translation>Die Sprache wechselt, wenn die Werkbank neu gestartet wird.</translation>
    </message>
</context>
<context>
    <name>QObject</name>
    <message>
        <source>Place %1</source>
        <translation>Ort %1</translation>
    </message>
    <message>
        <source>A session ended at %1 without being saved%2.</source>
        <translation>Eine Sitzung endete am %1, ohne gespeichert zu werden%2.</translation>
    </message>
    <message>
        <source> (last: %1)</source>
        <translation> (zuletzt: %1)</translation>
    </message>
    <message>
        <source>Open it</source>
        <translation>Öffnen</translation>
    </message>
    <message>
        <source>Later</source>
        <translation>Später</translation>
    </message>
    <message>
        <source>Delete it</source>
        <translation>Löschen</translation>
    </message>
    <message>
        <source> Earlier ones: %1.</source>
        <translation> Frühere: %1.</translation>
    </message>
    <message>
        <source>Show the one before</source>
        <translation>Die davor zeigen</translation>
    </message>
    <message>
        <source>Mouse</source>
        <translation>Maus</translation>
    </message>
    <message>
        <source>Left</source>
        <translation>Links</translation>
    </message>
    <message>
        <source>Shift + left (Align)</source>
        <translation>Umschalt + links (Ausrichten)</translation>
    </message>
    <message>
        <source>turn volumes</source>
        <translation>Volumen drehen</translation>
    </message>
    <message>
        <source>Wheel</source>
        <translation>Rad</translation>
    </message>
    <message>
        <source>through the slices (Shift: ten at a time)</source>
        <translation>durch die Schichten (Umschalt: je zehn)</translation>
    </message>
    <message>
        <source>Ctrl + wheel</source>
        <translation>Strg + Rad</translation>
    </message>
    <message>
        <source>zoom</source>
        <translation>vergrößern und verkleinern</translation>
    </message>
    <message>
        <source>Middle</source>
        <translation>Mitte</translation>
    </message>
    <message>
        <source>move the picture</source>
        <translation>das Bild verschieben</translation>
    </message>
    <message>
        <source>Shift + middle</source>
        <translation>Umschalt + Mitte</translation>
    </message>
    <message>
        <source>turn the plane of the slice</source>
        <translation>die Schichtebene drehen</translation>
    </message>
    <message>
        <source>Right</source>
        <translation>Rechts</translation>
    </message>
    <message>
        <source>contrast (sideways) and brightness (up and down)</source>
        <translation>Kontrast (seitwärts) und Helligkeit (auf und ab)</translation>
    </message>
    <message>
        <source>Double click</source>
        <translation>Doppelklick</translation>
    </message>
    <message>
        <source>make a view large, and back</source>
        <translation>eine Ansicht groß machen, und zurück</translation>
    </message>
    <message>
        <source>Right, double click</source>
        <translation>Rechts, Doppelklick</translation>
    </message>
    <message>
        <source>brightness and contrast as they were at first</source>
        <translation>Helligkeit und Kontrast wie am Anfang</translation>
    </message>
    <message>
        <source>Typing in a field</source>
        <translation>In ein Feld tippen</translation>
    </message>
    <message>
        <source>Return</source>
        <translation>Eingabetaste</translation>
    </message>
    <message>
        <source>takes what was typed, and gives the keys back to the views</source>
        <translation>übernimmt, was getippt wurde, und gibt die Tasten den Ansichten zurück</translation>
    </message>
    <message>
        <source>brings back what was there before, and gives the keys back to the views</source>
        <translation>bringt zurück, was vorher da war, und gibt die Tasten den Ansichten zurück</translation>
    </message>
    <message>
        <source>Moving volumes (tool Align)</source>
        <translation>Volumen bewegen (Werkzeug Ausrichten)</translation>
    </message>
    <message>
        <source>x, y, z</source>
        <translation>x, y, z</translation>
    </message>
    <message>
        <source>restrict motion to this axis; press again for the plane perpendicular to it, and again for free motion</source>
        <translation>Bewegung auf diese Achse beschränken; noch einmal: auf die Ebene senkrecht dazu; noch einmal: frei</translation>
    </message>
    <message>
        <source>Arrows</source>
        <translation>Pfeile</translation>
    </message>
    <message>
        <source>move by one step in the view</source>
        <translation>um einen Schritt in der Ansicht bewegen</translation>
    </message>
    <message>
        <source>Page up, Page down</source>
        <translation>Bild auf, Bild ab</translation>
    </message>
    <message>
        <source>move by one step towards you, and away</source>
        <translation>um einen Schritt auf Sie zu und von Ihnen weg bewegen</translation>
    </message>
    <message>
        <source>Ctrl + arrows, Ctrl + Page up, Page down</source>
        <translation>Strg + Pfeile, Strg + Bild auf, Bild ab</translation>
    </message>
    <message>
        <source>turn by one step</source>
        <translation>um einen Schritt drehen</translation>
    </message>
    <message>
        <source>+, -</source>
        <translation>+, -</translation>
    </message>
    <message>
        <source>double or halve the step size</source>
        <translation>die Schrittweite verdoppeln oder halbieren</translation>
    </message>
    <message>
        <source>c</source>
        <translation>c</translation>
    </message>
    <message>
        <source>put the centre of rotation where the mouse is</source>
        <translation>den Drehpunkt an die Maus setzen</translation>
    </message>
    <message>
        <source>Shift + c</source>
        <translation>Umschalt + c</translation>
    </message>
    <message>
        <source>put it back in the middle of what is selected</source>
        <translation>ihn zurück in die Mitte der Auswahl setzen</translation>
    </message>
    <message>
        <source>Escape</source>
        <translation>Escape</translation>
    </message>
    <message>
        <source>Keys</source>
        <translation>Tasten</translation>
    </message>
    <message>
        <source>Keys and mouse</source>
        <translation>Tasten und Maus</translation>
    </message>
    <message>
        <source>outside</source>
        <translation>außerhalb</translation>
    </message>
    <message>
        <source>the tool in hand: move volumes, paint, carve, restore, mark, measure, or point</source>
        <translation>das gewählte Werkzeug: Volumen bewegen, malen, schnitzen, wiederherstellen, markieren, messen oder zeigen</translation>
    </message>
    <message>
        <source>take a drag back, end flickering, or show all volumes again</source>
        <translation>ein Ziehen zurücknehmen, das Wechselbild beenden oder wieder alle Volumen zeigen</translation>
    </message>
</context>
<context>
    <name>Samples</name>
    <message>
        <source>&amp;Two volumes</source>
        <translation>&amp;Zwei Volumen</translation>
    </message>
    <message>
        <source>Two overlapping volumes of an invented body, of which one lies wrong</source>
        <translation>Zwei überlappende Volumen eines erfundenen Körpers, von denen eines falsch liegt</translation>
    </message>
    <message>
        <source>&amp;Four volumes</source>
        <translation>&amp;Vier Volumen</translation>
    </message>
    <message>
        <source>Four overlapping volumes in a row, of which three lie wrong</source>
        <translation>Vier überlappende Volumen hintereinander, von denen drei falsch liegen</translation>
    </message>
    <message>
        <source>Two far &amp;apart</source>
        <translation>Zwei weit aus&amp;einander</translation>
    </message>
    <message>
        <source>Two volumes of one body with three metal clips, 70 mm apart</source>
        <translation>Zwei Volumen eines Körpers mit drei Metallklammern, 70 mm auseinander</translation>
    </message>
    <message>
        <source>Five pairs, one &amp;wrong</source>
        <translation>Fünf Paare, eines &amp;falsch</translation>
    </message>
    <message>
        <source>Six volumes in a row that were aligned, but for one joint</source>
        <translation>Sechs ausgerichtete Volumen in einer Reihe, nur an einer Fuge nicht</translation>
    </message>
    <message>
        <source>Stone with a &amp;shadow</source>
        <translation>Stein mit &amp;Schatten</translation>
    </message>
    <message>
        <source>Two volumes with a metal clip each; a stone casts a shadow in the first one</source>
        <translation>Zwei Volumen mit je einer Metallklammer; im ersten wirft ein Stein einen Schatten</translation>
    </message>
</context>
<context>
    <name>echorama::BrushPanel</name>
    <message>
        <source>Radius of the brush ([ smaller, ] larger)</source>
        <translation>Radius des Pinsels ([ kleiner, ] größer)</translation>
    </message>
    <message>
        <source>Grey level that is painted</source>
        <translation>Grauwert, der gemalt wird</translation>
    </message>
    <message>
        <source>How much of the grey level covers what is there, 0 to 1</source>
        <translation>Wie weit der Grauwert deckt, 0 bis 1</translation>
    </message>
    <message>
        <source>Share of the radius that is painted in full; outside it fades, 0 to 1</source>
        <translation>Anteil des Radius, der voll gemalt wird; außerhalb läuft er aus, 0 bis 1</translation>
    </message>
    <message>
        <source>Only where there are data</source>
        <translation>Nur wo Daten sind</translation>
    </message>
    <message>
        <source>The brush does not reach beyond the borders of the volume&apos;s data</source>
        <translation>Der Pinsel reicht nicht über den Rand der Daten des Volumens</translation>
    </message>
    <message>
        <source>Radius</source>
        <translation>Radius</translation>
    </message>
    <message>
        <source>Grey level</source>
        <translation>Grauwert</translation>
    </message>
    <message>
        <source>Opacity</source>
        <translation>Deckkraft</translation>
    </message>
    <message>
        <source>Hardness</source>
        <translation>Härte</translation>
    </message>
    <message>
        <source>Paint: drag in a slice of the selected volume.</source>
        <translation>Malen: in einer Schicht des gewählten Volumens ziehen.</translation>
    </message>
    <message>
        <source>Carve: what the brush touches is taken away. Restore brings it back.</source>
        <translation>Schnitzen: was der Pinsel berührt, wird weggenommen. Wiederherstellen bringt es zurück.</translation>
    </message>
    <message>
        <source>Restore: what the brush touches becomes as it was in the file.</source>
        <translation>Wiederherstellen: was der Pinsel berührt, wird, wie es in der Datei war.</translation>
    </message>
    <message>
        <source>Pick Paint (3), Carve (4) or Restore (5), then drag in a slice.</source>
        <translation>Malen (3), Schnitzen (4) oder Wiederherstellen (5) wählen, dann in einer Schicht ziehen.</translation>
    </message>
</context>
<context>
    <name>echorama::CheckPanel</name>
    <message>
        <source>Disagreement</source>
        <translation>Abweichung</translation>
    </message>
    <message>
        <source>Under the mouse</source>
        <translation>Unter der Maus</translation>
    </message>
    <message>
        <source>Grey level of each volume where the mouse points</source>
        <translation>Grauwert jedes Volumens dort, wohin die Maus zeigt</translation>
    </message>
    <message>
        <source>Volume</source>
        <translation>Volumen</translation>
    </message>
    <message>
        <source>Grey level</source>
        <translation>Grauwert</translation>
    </message>
    <message>
        <source>Measurements</source>
        <translation>Messungen</translation>
    </message>
    <message>
        <source>Distances (tool Measure, key 7) and angles (tool Angle, key 8). Their points can be dragged in the slices. The profile is that of the selected distance.</source>
        <translation>Strecken (Werkzeug Messen, Taste 7) und Winkel (Werkzeug Winkel, Taste 8). Ihre Punkte lassen sich in den Schichten ziehen. Das Profil ist das der gewählten Strecke.</translation>
    </message>
    <message>
        <source>No.</source>
        <translation>Nr.</translation>
    </message>
    <message>
        <source>What</source>
        <translation>Was</translation>
    </message>
    <message>
        <source>Value</source>
        <translation>Wert</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Entfernen</translation>
    </message>
    <message>
        <source>Removes the measurements that are selected in the list (Delete)</source>
        <translation>Entfernt die Messungen, die in der Liste gewählt sind (Entf)</translation>
    </message>
    <message>
        <source>Clear</source>
        <translation>Leeren</translation>
    </message>
    <message>
        <source>Removes all measurements; can be undone</source>
        <translation>Entfernt alle Messungen; lässt sich rückgängig machen</translation>
    </message>
    <message>
        <source>Flicker</source>
        <translation>Wechselbild</translation>
    </message>
    <message>
        <source>What is shown by turns with the other</source>
        <translation>Was im Wechsel mit dem anderen gezeigt wird</translation>
    </message>
    <message>
        <source>What is shown by turns with the first</source>
        <translation>Was im Wechsel mit dem ersten gezeigt wird</translation>
    </message>
    <message>
        <source>Changes per second</source>
        <translation>Wechsel je Sekunde</translation>
    </message>
    <message>
        <source> /s</source>
        <translation> /s</translation>
    </message>
    <message>
        <source>Flicker (Shift+Space)</source>
        <translation>Wechselbild (Umschalt+Leertaste)</translation>
    </message>
    <message>
        <source>Shows both by turns in the slices: what does not agree jumps. Ends by itself when something is dragged</source>
        <translation>Zeigt beide im Wechsel in den Schichten: Was nicht übereinstimmt, springt. Endet von selbst, wenn etwas gezogen wird</translation>
    </message>
    <message>
        <source>Between</source>
        <translation>Zwischen</translation>
    </message>
    <message>
        <source>and</source>
        <translation>und</translation>
    </message>
    <message>
        <source>Rate</source>
        <translation>Tempo</translation>
    </message>
    <message>
        <source>Selected</source>
        <translation>Gewählte</translation>
    </message>
    <message>
        <source>Others</source>
        <translation>Andere</translation>
    </message>
    <message>
        <source>°</source>
        <translation>°</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Angle</source>
        <translation>Winkel</translation>
    </message>
    <message>
        <source>Distance</source>
        <translation>Strecke</translation>
    </message>
    <message>
        <source>Remove measurements</source>
        <translation>Messungen entfernen</translation>
    </message>
</context>
<context>
    <name>echorama::DisagreementBox</name>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>&amp;Find disagreement</source>
        <translation>Abweichung &amp;finden</translation>
    </message>
    <message>
        <source>How far the volumes that are shown are from agreeing, block by block, in the background</source>
        <translation>Wie weit die gezeigten Volumen davon entfernt sind, übereinzustimmen, Block für Block, im Hintergrund</translation>
    </message>
    <message>
        <source>Show in slices</source>
        <translation>In Schichten zeigen</translation>
    </message>
    <message>
        <source>Colours where something is known; where there is no colour, nothing is</source>
        <translation>Farben, wo etwas bekannt ist; wo keine Farbe ist, ist nichts bekannt</translation>
    </message>
    <message>
        <source>The shift that has the brightest colour</source>
        <translation>Die Verschiebung, die die hellste Farbe hat</translation>
    </message>
    <message>
        <source>Shifts are looked for so far; what is farther apart stays without colour</source>
        <translation>So weit werden Verschiebungen gesucht; was weiter auseinander liegt, bleibt ohne Farbe</translation>
    </message>
    <message>
        <source>Side of the blocks that are compared: larger ones know more, and tell less of where</source>
        <translation>Kante der Blöcke, die verglichen werden: größere wissen mehr und sagen weniger genau, wo</translation>
    </message>
    <message>
        <source>Where the mouse points</source>
        <translation>Dort, wohin die Maus zeigt</translation>
    </message>
    <message>
        <source>Search</source>
        <translation>Suche</translation>
    </message>
    <message>
        <source>Blocks</source>
        <translation>Blöcke</translation>
    </message>
    <message>
        <source>Scale to</source>
        <translation>Skala bis</translation>
    </message>
    <message>
        <source>Disagreement</source>
        <translation>Abweichung</translation>
    </message>
    <message>
        <source>%1: two volumes that are shown are needed</source>
        <translation>%1: zwei gezeigte Volumen sind nötig</translation>
    </message>
    <message>
        <source>%1 of %2 blocks tell something.</source>
        <translation>%1 von %2 Blöcken sagen etwas aus.</translation>
    </message>
    <message>
        <source>Median %1 mm, 95% below %2 mm.</source>
        <translation>Median %1 mm, 95% unter %2 mm.</translation>
    </message>
    <message>
        <source>The volumes do not overlap.</source>
        <translation>Die Volumen überlappen nicht.</translation>
    </message>
    <message>
        <source>Stale: volumes have changed since.</source>
        <translation>Veraltet: Volumen haben sich seither geändert.</translation>
    </message>
    <message>
        <source>Under the mouse: not known</source>
        <translation>Unter der Maus: nicht bekannt</translation>
    </message>
    <message>
        <source>, in two directions; the third is not known</source>
        <translation>, in zwei Richtungen; die dritte ist nicht bekannt</translation>
    </message>
    <message>
        <source>, across an edge; along it is not known</source>
        <translation>, quer zu einer Kante; längs ist es nicht bekannt</translation>
    </message>
    <message>
        <source>Under the mouse: %1 ± %2 mm, %3 and %4%5</source>
        <translation>Unter der Maus: %1 ± %2 mm, %3 und %4%5</translation>
    </message>
</context>
<context>
    <name>echorama::EditActions</name>
    <message>
        <source>&amp;Undo</source>
        <translation>&amp;Rückgängig</translation>
    </message>
    <message>
        <source>Take the last edit back</source>
        <translation>Die letzte Änderung zurücknehmen</translation>
    </message>
    <message>
        <source>&amp;Redo</source>
        <translation>&amp;Wiederholen</translation>
    </message>
    <message>
        <source>Make the edit again</source>
        <translation>Die Änderung noch einmal machen</translation>
    </message>
    <message>
        <source>Select &amp;all</source>
        <translation>&amp;Alle wählen</translation>
    </message>
    <message>
        <source>Select all volumes</source>
        <translation>Alle Volumen wählen</translation>
    </message>
    <message>
        <source>Select &amp;none</source>
        <translation>&amp;Keines wählen</translation>
    </message>
    <message>
        <source>Select no volume</source>
        <translation>Kein Volumen wählen</translation>
    </message>
    <message>
        <source>&amp;Invert selection</source>
        <translation>Auswahl &amp;umkehren</translation>
    </message>
    <message>
        <source>Select those that are not selected</source>
        <translation>Die wählen, die nicht gewählt sind</translation>
    </message>
    <message>
        <source>&amp;Group</source>
        <translation>&amp;Gruppieren</translation>
    </message>
    <message>
        <source>Keep the selected volumes together</source>
        <translation>Die gewählten Volumen beisammen halten</translation>
    </message>
    <message>
        <source>U&amp;ngroup</source>
        <translation>Gruppe au&amp;flösen</translation>
    </message>
    <message>
        <source>Let the selected volumes move alone again</source>
        <translation>Die gewählten Volumen wieder einzeln bewegen</translation>
    </message>
    <message>
        <source>Re&amp;move volumes</source>
        <translation>Volumen &amp;entfernen</translation>
    </message>
    <message>
        <source>Take the selected volumes out of the session; their files stay, and it can be undone</source>
        <translation>Die gewählten Volumen aus der Sitzung nehmen; ihre Dateien bleiben, und es lässt sich rückgängig machen</translation>
    </message>
    <message>
        <source>&amp;Undo: %1</source>
        <translation>&amp;Rückgängig: %1</translation>
    </message>
    <message>
        <source>&amp;Redo: %1</source>
        <translation>&amp;Wiederholen: %1</translation>
    </message>
    <message>
        <source>Remove %1</source>
        <translation>%1 entfernen</translation>
    </message>
    <message>
        <source>Remove %1 volumes</source>
        <translation>%1 Volumen entfernen</translation>
    </message>
</context>
<context>
    <name>echorama::EmptyPage</name>
    <message>
        <source>Begin with two or more volumes that overlap</source>
        <translation>Beginnen Sie mit zwei oder mehr Volumen, die sich überlappen</translation>
    </message>
    <message>
        <source>&amp;Open volumes...</source>
        <translation>Volumen &amp;öffnen...</translation>
    </message>
    <message>
        <source>Open a &amp;project...</source>
        <translation>Ein &amp;Projekt öffnen...</translation>
    </message>
    <message>
        <source>or drop files anywhere on this window</source>
        <translation>oder lassen Sie Dateien irgendwo auf diesem Fenster fallen</translation>
    </message>
    <message>
        <source>No volumes at hand? Samples are made here, in seconds:</source>
        <translation>Keine Volumen zur Hand? Beispiele entstehen hier in Sekunden:</translation>
    </message>
</context>
<context>
    <name>echorama::ExportActions</name>
    <message>
        <source>Export &amp;poses...</source>
        <translation>&amp;Lagen exportieren...</translation>
    </message>
    <message>
        <source>For echorama stitch, and all that reads pose files</source>
        <translation>Für echorama stitch und alles, was Lagedateien liest</translation>
    </message>
    <message>
        <source>Export poses</source>
        <translation>Lagen exportieren</translation>
    </message>
    <message>
        <source>Poses (*.json)</source>
        <translation>Lagen (*.json)</translation>
    </message>
    <message>
        <source>Export &amp;volumes...</source>
        <translation>&amp;Volumen exportieren...</translation>
    </message>
    <message>
        <source>The volumes that are shown, with their new geometry and what was painted</source>
        <translation>Die gezeigten Volumen mit ihrer neuen Geometrie und dem, was gemalt wurde</translation>
    </message>
    <message>
        <source>Export volumes to</source>
        <translation>Volumen exportieren nach</translation>
    </message>
    <message>
        <source>Export &amp;transforms...</source>
        <translation>&amp;Transformationen exportieren...</translation>
    </message>
    <message>
        <source>One transform of ITK (.tfm) per volume that is shown, for 3D Slicer</source>
        <translation>Je gezeigtem Volumen eine ITK-Transformation (.tfm), für 3D Slicer</translation>
    </message>
    <message>
        <source>Export transforms to</source>
        <translation>Transformationen exportieren nach</translation>
    </message>
    <message>
        <source>Export volumes: %1</source>
        <translation>Volumen exportieren: %1</translation>
    </message>
    <message>
        <source>Export volumes</source>
        <translation>Volumen exportieren</translation>
    </message>
    <message>
        <source>Exported %1 volumes to %2</source>
        <translation>%1 Volumen nach %2 exportiert</translation>
    </message>
    <message>
        <source>Exported %1 transforms to %2</source>
        <translation>%1 Transformationen nach %2 exportiert</translation>
    </message>
    <message>
        <source>Export transforms: %1</source>
        <translation>Transformationen exportieren: %1</translation>
    </message>
    <message>
        <source>Exported poses to %1</source>
        <translation>Lagen nach %1 exportiert</translation>
    </message>
    <message>
        <source>Choose another place...</source>
        <translation>Einen anderen Ort wählen...</translation>
    </message>
</context>
<context>
    <name>echorama::FileActions</name>
    <message>
        <source>Volumes (%1);;All files (*)</source>
        <translation>Volumen (%1);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Projects (*.json);;All files (*)</source>
        <translation>Projekte (*.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>&amp;Open volumes...</source>
        <translation>Volumen &amp;öffnen...</translation>
    </message>
    <message>
        <source>Open volumes; files can be dropped on the window, too</source>
        <translation>Volumen öffnen; Dateien kann man auch auf das Fenster fallen lassen</translation>
    </message>
    <message>
        <source>Open volumes</source>
        <translation>Volumen öffnen</translation>
    </message>
    <message>
        <source>Open &amp;project...</source>
        <translation>&amp;Projekt öffnen...</translation>
    </message>
    <message>
        <source>Open volumes with their poses and strokes</source>
        <translation>Volumen mit ihren Lagen und Pinselstrichen öffnen</translation>
    </message>
    <message>
        <source>Open a project</source>
        <translation>Ein Projekt öffnen</translation>
    </message>
    <message>
        <source>&amp;Save project</source>
        <translation>Projekt &amp;speichern</translation>
    </message>
    <message>
        <source>Save poses, strokes and how volumes are shown</source>
        <translation>Lagen, Pinselstriche und Darstellung speichern</translation>
    </message>
    <message>
        <source>Save project &amp;as...</source>
        <translation>Projekt speichern &amp;unter...</translation>
    </message>
    <message>
        <source>Save the project under another name</source>
        <translation>Das Projekt unter anderem Namen speichern</translation>
    </message>
    <message>
        <source>&amp;Read poses...</source>
        <translation>Lagen &amp;lesen...</translation>
    </message>
    <message>
        <source>Put the volumes where a pose file says; can be undone</source>
        <translation>Die Volumen dorthin legen, wo eine Lagedatei sie hat; lässt sich rückgängig machen</translation>
    </message>
    <message>
        <source>Read poses</source>
        <translation>Lagen lesen</translation>
    </message>
    <message>
        <source>Poses (*.json);;All files (*)</source>
        <translation>Lagen (*.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>One project can be open at a time: %1 is opened. Open the others one by one.</source>
        <translation>Nur ein Projekt kann offen sein: %1 wird geöffnet. Öffnen Sie die anderen nacheinander.</translation>
    </message>
    <message>
        <source>Read another file...</source>
        <translation>Eine andere Datei lesen...</translation>
    </message>
    <message>
        <source>Reading %1</source>
        <translation>%1 wird gelesen</translation>
    </message>
    <message>
        <source>Reading %1 volumes</source>
        <translation>%1 Volumen werden gelesen</translation>
    </message>
    <message>
        <source>and %1 more that cannot be read</source>
        <translation>und %1 weitere, die nicht lesbar sind</translation>
    </message>
    <message>
        <source>Open other files...</source>
        <translation>Andere Dateien öffnen...</translation>
    </message>
    <message>
        <source>%1 is large: one of %2 voxels along each axis was read. Poses that are found here hold for the whole; what is stitched here is as coarse, and echorama stitch --memory makes it of all voxels.</source>
        <translation>%1 ist groß: Entlang jeder Achse wurde nur eines von %2 Voxeln gelesen. Lagen, die hier gefunden werden, gelten für das Ganze; was hier zusammengefügt wird, ist ebenso grob, und echorama stitch --memory macht es aus allen Voxeln.</translation>
    </message>
    <message>
        <source>Save what you did before %1 is opened?</source>
        <translation>Ihre Arbeit speichern, bevor %1 geöffnet wird?</translation>
    </message>
    <message>
        <source>Save what you did before the other session is opened?</source>
        <translation>Ihre Arbeit speichern, bevor die andere Sitzung geöffnet wird?</translation>
    </message>
    <message>
        <source>Open another project...</source>
        <translation>Ein anderes Projekt öffnen...</translation>
    </message>
    <message>
        <source>%1
Files of %2 have moved. Where are they now?</source>
        <translation>%1
Dateien von %2 sind nicht mehr an ihrem Ort. Wo sind sie jetzt?</translation>
    </message>
    <message>
        <source>Look in a folder...</source>
        <translation>In einem Ordner suchen...</translation>
    </message>
    <message>
        <source>Where the volumes are</source>
        <translation>Wo die Volumen sind</translation>
    </message>
    <message>
        <source>Do not open it</source>
        <translation>Nicht öffnen</translation>
    </message>
    <message>
        <source>Opening %1</source>
        <translation>%1 wird geöffnet</translation>
    </message>
    <message>
        <source>This project has unsaved changes, last backed up at %1.</source>
        <translation>Dieses Projekt hat ungespeicherte Änderungen, zuletzt gesichert am %1.</translation>
    </message>
    <message>
        <source>Restore them</source>
        <translation>Wiederherstellen</translation>
    </message>
    <message>
        <source>Ignore them</source>
        <translation>Nicht beachten</translation>
    </message>
    <message>
        <source>Save as...</source>
        <translation>Speichern unter...</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>Noch einmal versuchen</translation>
    </message>
    <message>
        <source>Saved %1</source>
        <translation>%1 gespeichert</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Do not save</source>
        <translation>Nicht speichern</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Save the project</source>
        <translation>Das Projekt speichern</translation>
    </message>
    <message>
        <source>Projects (*.json)</source>
        <translation>Projekte (*.json)</translation>
    </message>
    <message>
        <source>%1 is in no file yet, and a project holds files. Save it beside the project, as %2?</source>
        <translation>%1 ist noch in keiner Datei, und ein Projekt enthält Dateien. Neben dem Projekt speichern, als %2?</translation>
    </message>
    <message>
        <source>Save it there</source>
        <translation>Dort speichern</translation>
    </message>
    <message>
        <source>Leave it out</source>
        <translation>Weglassen</translation>
    </message>
</context>
<context>
    <name>echorama::Flicker</name>
    <message>
        <source>Flicker: select one of the volumes, and leave another; or choose two in the panel Check.</source>
        <translation>Wechselbild: Wählen Sie eines der Volumen, und lassen Sie ein anderes ungewählt; oder wählen Sie zwei in der Tafel Prüfen.</translation>
    </message>
</context>
<context>
    <name>echorama::GuideBar</name>
    <message>
        <source>Open</source>
        <translation>Öffnen</translation>
    </message>
    <message>
        <source>Open two or more volumes that overlap; their files can be dropped here.</source>
        <translation>Öffnen Sie zwei oder mehr überlappende Volumen; ihre Dateien kann man hier fallen lassen.</translation>
    </message>
    <message>
        <source>Open...</source>
        <translation>Öffnen...</translation>
    </message>
    <message>
        <source>Align</source>
        <translation>Ausrichten</translation>
    </message>
    <message>
        <source>Drag the selected volume until it nearly fits; Refine finds the exact place.</source>
        <translation>Ziehen Sie das gewählte Volumen, bis es fast passt; Verfeinern findet den genauen Ort.</translation>
    </message>
    <message>
        <source>Refine</source>
        <translation>Verfeinern</translation>
    </message>
    <message>
        <source>Check</source>
        <translation>Prüfen</translation>
    </message>
    <message>
        <source>Look whether it is right: where volumes agree, their difference is dark.</source>
        <translation>Sehen Sie nach, ob es stimmt: Wo Volumen übereinstimmen, ist ihre Differenz dunkel.</translation>
    </message>
    <message>
        <source>Difference</source>
        <translation>Differenz</translation>
    </message>
    <message>
        <source>Stitch</source>
        <translation>Zusammenfügen</translation>
    </message>
    <message>
        <source>Embed</source>
        <translation>Einbetten</translation>
    </message>
    <message>
        <source>Put the stitched volume into the fan that holds it, among noise of its own grain.</source>
        <translation>Legen Sie das Ergebnis in den Fächer, der es fasst, in Rauschen seiner eigenen Körnung.</translation>
    </message>
    <message>
        <source>Save</source>
        <translation>Speichern</translation>
    </message>
    <message>
        <source>Save...</source>
        <translation>Speichern...</translation>
    </message>
    <message>
        <source>Guide</source>
        <translation>Wegweiser</translation>
    </message>
    <message>
        <source>Does this step, or opens what does</source>
        <translation>Macht diesen Schritt, oder öffnet, was ihn macht</translation>
    </message>
    <message>
        <source>Close the guide; the menu Help brings it back</source>
        <translation>Den Wegweiser schließen; das Menü Hilfe bringt ihn zurück</translation>
    </message>
    <message>
        <source>%1: done</source>
        <translation>%1: getan</translation>
    </message>
    <message>
        <source>All is done and saved.</source>
        <translation>Alles ist getan und gespeichert.</translation>
    </message>
    <message>
        <source>Make one volume of all that are shown; it joins the others.</source>
        <translation>Machen Sie ein Volumen aus allen, die gezeigt sind; es kommt zu den anderen.</translation>
    </message>
    <message>
        <source>Keep the work as a project; the stitched volume is saved beside it.</source>
        <translation>Behalten Sie die Arbeit als Projekt; das Ergebnis wird daneben gespeichert.</translation>
    </message>
</context>
<context>
    <name>echorama::HistoryPanel</name>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Takes the last edit back (Ctrl+Z)</source>
        <translation>Nimmt die letzte Änderung zurück (Strg+Z)</translation>
    </message>
    <message>
        <source>Redo</source>
        <translation>Wiederholen</translation>
    </message>
    <message>
        <source>Makes it again (Ctrl+Shift+Z)</source>
        <translation>Macht sie noch einmal (Strg+Umschalt+Z)</translation>
    </message>
    <message>
        <source>Backups (click one to return to it; this can be undone)</source>
        <translation>Sicherungen (ein Klick kehrt zu einer zurück; das lässt sich rückgängig machen)</translation>
    </message>
    <message>
        <source>Backups, the newest first</source>
        <translation>Sicherungen, die neueste zuerst</translation>
    </message>
    <message>
        <source>Listing backups</source>
        <translation>Sicherungen werden gesucht</translation>
    </message>
    <message>
        <source>Backups cannot be listed: %1</source>
        <translation>Sicherungen lassen sich nicht auflisten: %1</translation>
    </message>
    <message>
        <source>Choose another backup</source>
        <translation>Eine andere Sicherung wählen</translation>
    </message>
</context>
<context>
    <name>echorama::JobBar</name>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>Stop this. Everything stays as it was.</source>
        <translation>Das hier anhalten. Alles bleibt, wie es war.</translation>
    </message>
    <message>
        <source>Stopping: %1</source>
        <translation>Wird angehalten: %1</translation>
    </message>
</context>
<context>
    <name>echorama::LandmarkBox</name>
    <message>
        <source>Landmarks</source>
        <translation>Landmarken</translation>
    </message>
    <message>
        <source>Label</source>
        <translation>Bezeichnung</translation>
    </message>
    <message>
        <source>In</source>
        <translation>In</translation>
    </message>
    <message>
        <source>Apart</source>
        <translation>Abstand</translation>
    </message>
    <message>
        <source>How exactly they are marked: the standard deviation of how far apart two of one label lie, along each axis</source>
        <translation>Wie genau sie markiert sind: die Standardabweichung des Abstands zweier einer Bezeichnung, je Achse</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Exact to</source>
        <translation>Genau auf</translation>
    </message>
    <message>
        <source>Remove</source>
        <translation>Entfernen</translation>
    </message>
    <message>
        <source>Removes the landmarks that are selected in the list</source>
        <translation>Entfernt die Landmarken, die in der Liste gewählt sind</translation>
    </message>
    <message>
        <source>Clear</source>
        <translation>Leeren</translation>
    </message>
    <message>
        <source>Removes all landmarks of all volumes</source>
        <translation>Entfernt alle Landmarken aller Volumen</translation>
    </message>
    <message>
        <source>%1 mm</source>
        <translation>%1 mm</translation>
    </message>
    <message>
        <source>Remove landmarks</source>
        <translation>Landmarken entfernen</translation>
    </message>
    <message>
        <source>Places that were marked (tool Mark, key 6), and how far apart the volumes put those of one label. Two or three in both volumes tell places apart that look alike. Choosing one brings the slices there.</source>
        <translation>Orte, die markiert wurden (Werkzeug Markieren, Taste 6), und wie weit auseinander die Volumen die einer Bezeichnung haben. Zwei oder drei in beiden Volumen unterscheiden Orte, die gleich aussehen. Eine zu wählen bringt die Schichten dorthin.</translation>
    </message>
</context>
<context>
    <name>echorama::MainWindow</name>
    <message>
        <source>&amp;Quit</source>
        <translation>&amp;Beenden</translation>
    </message>
    <message>
        <source>Ends the program; asks first when something is not saved</source>
        <translation>Beendet das Programm; fragt vorher, wenn etwas nicht gespeichert ist</translation>
    </message>
    <message>
        <source>Copy the text</source>
        <translation>Den Text kopieren</translation>
    </message>
    <message>
        <source>&amp;File</source>
        <translation>&amp;Datei</translation>
    </message>
    <message>
        <source>&amp;Edit</source>
        <translation>&amp;Bearbeiten</translation>
    </message>
    <message>
        <source>&amp;View</source>
        <translation>&amp;Ansicht</translation>
    </message>
    <message>
        <source>&amp;Tools</source>
        <translation>&amp;Werkzeuge</translation>
    </message>
    <message>
        <source>&amp;Align</source>
        <translation>Aus&amp;richten</translation>
    </message>
    <message>
        <source>&amp;Stitch</source>
        <translation>&amp;Zusammenfügen</translation>
    </message>
    <message>
        <source>&amp;Help</source>
        <translation>&amp;Hilfe</translation>
    </message>
    <message>
        <source>Tools</source>
        <translation>Werkzeuge</translation>
    </message>
    <message>
        <source>Undo</source>
        <translation>Rückgängig</translation>
    </message>
    <message>
        <source>Redo</source>
        <translation>Wiederholen</translation>
    </message>
    <message>
        <source>Looks</source>
        <translation>Darstellung</translation>
    </message>
    <message>
        <source>&amp;Preferences...</source>
        <translation>&amp;Einstellungen...</translation>
    </message>
    <message>
        <source>Colours of volumes, light or dark, language</source>
        <translation>Farben der Volumen, hell oder dunkel, Sprache</translation>
    </message>
    <message>
        <source>&amp;Keys and mouse</source>
        <translation>&amp;Tasten und Maus</translation>
    </message>
    <message>
        <source>What keys and mouse buttons do</source>
        <translation>Was Tasten und Maus tun</translation>
    </message>
    <message>
        <source>&amp;Go to panel</source>
        <translation>Zur Ta&amp;fel gehen</translation>
    </message>
    <message>
        <source>Panels that are sho&amp;wn</source>
        <translation>&amp;Gezeigte Tafeln</translation>
    </message>
    <message>
        <source>Volumes</source>
        <translation>Volumen</translation>
    </message>
    <message>
        <source>Pose</source>
        <translation>Lage</translation>
    </message>
    <message>
        <source>View</source>
        <translation>Ansicht</translation>
    </message>
    <message>
        <source>Brush</source>
        <translation>Pinsel</translation>
    </message>
    <message>
        <source>History</source>
        <translation>Verlauf</translation>
    </message>
    <message>
        <source>Align</source>
        <translation>Ausrichten</translation>
    </message>
    <message>
        <source>&amp;Refine from here</source>
        <translation>Von hier &amp;verfeinern</translation>
    </message>
    <message>
        <source>Align the selected volumes to the others from where they are; can be undone</source>
        <translation>Die gewählten Volumen von ihrer Lage aus an den anderen ausrichten; lässt sich rückgängig machen</translation>
    </message>
    <message>
        <source>Align &amp;all</source>
        <translation>&amp;Alle ausrichten</translation>
    </message>
    <message>
        <source>Align all volumes to the first; can be undone</source>
        <translation>Alle Volumen am ersten ausrichten; lässt sich rückgängig machen</translation>
    </message>
    <message>
        <source>Stitch</source>
        <translation>Zusammenfügen</translation>
    </message>
    <message>
        <source>&amp;Stitch and embed</source>
        <translation>&amp;Zusammenfügen und einbetten</translation>
    </message>
    <message>
        <source>Make one volume of those that are shown: the panel Stitch</source>
        <translation>Ein Volumen aus den gezeigten machen: die Tafel Zusammenfügen</translation>
    </message>
    <message>
        <source>Train</source>
        <translation>Üben</translation>
    </message>
    <message>
        <source>Tracker</source>
        <translation>Tracker</translation>
    </message>
    <message>
        <source>&amp;Guide</source>
        <translation>&amp;Wegweiser</translation>
    </message>
    <message>
        <source>Six steps from volumes to one volume</source>
        <translation>Sechs Schritte von Volumen zu einem Volumen</translation>
    </message>
    <message>
        <source>Making a sample</source>
        <translation>Ein Beispiel wird gemacht</translation>
    </message>
    <message>
        <source>Show the panel %1 and go into it</source>
        <translation>Die Tafel %1 zeigen und hineingehen</translation>
    </message>
    <message>
        <source>Not saved yet</source>
        <translation>Noch nicht gespeichert</translation>
    </message>
    <message>
        <source>Save as...</source>
        <translation>Speichern unter...</translation>
    </message>
    <message>
        <source>Show panel %1</source>
        <translation>Tafel %1 zeigen</translation>
    </message>
    <message>
        <source>%1 is still running.</source>
        <translation>Läuft noch: %1.</translation>
    </message>
    <message>
        <source>Stay</source>
        <translation>Bleiben</translation>
    </message>
    <message>
        <source>Close when it is done</source>
        <translation>Schließen, wenn es fertig ist</translation>
    </message>
    <message>
        <source>Stop it and close</source>
        <translation>Anhalten und schließen</translation>
    </message>
    <message>
        <source>Save what you did before the window closes?</source>
        <translation>Ihre Arbeit speichern, bevor das Fenster schließt?</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>Noch einmal versuchen</translation>
    </message>
    <message>
        <source>Check</source>
        <translation>Prüfen</translation>
    </message>
    <message>
        <source>&amp;Compare with sources</source>
        <translation>Mit &amp;Quellen vergleichen</translation>
    </message>
    <message>
        <source>Show the result alone, and then its sources instead, in all views</source>
        <translation>Das Ergebnis allein zeigen, dann stattdessen seine Quellen, in allen Ansichten</translation>
    </message>
</context>
<context>
    <name>echorama::MeasureTool</name>
    <message>
        <source>Change measurement %1</source>
        <translation>Messung %1 ändern</translation>
    </message>
</context>
<context>
    <name>echorama::MessageBar</name>
    <message>
        <source>Close this message</source>
        <translation>Diese Meldung schließen</translation>
    </message>
</context>
<context>
    <name>echorama::PairBox</name>
    <message>
        <source>Pairs</source>
        <translation>Paare</translation>
    </message>
    <message>
        <source>The pairs that were aligned, and the error that each predicts. Choosing one shows its volumes alone, where they overlap; a second click, or Escape, brings all back.</source>
        <translation>Die Paare, die ausgerichtet wurden, und der Fehler, den jedes vorhersagt. Eines zu wählen zeigt nur seine Volumen, dort, wo sie überlappen; ein zweiter Klick oder Escape bringt alle zurück.</translation>
    </message>
    <message>
        <source>Pair</source>
        <translation>Paar</translation>
    </message>
    <message>
        <source>Answer</source>
        <translation>Antwort</translation>
    </message>
    <message>
        <source>Error</source>
        <translation>Fehler</translation>
    </message>
    <message>
        <source>%1 – %2</source>
        <translation>%1 – %2</translation>
    </message>
    <message>
        <source>%1, voted down</source>
        <translation>%1, überstimmt</translation>
    </message>
    <message>
        <source>%1 mm</source>
        <translation>%1 mm</translation>
    </message>
    <message>
        <source>%1 and %2 alone; Escape brings all back</source>
        <translation>Nur %1 und %2; Escape bringt alle zurück</translation>
    </message>
</context>
<context>
    <name>echorama::PairGraph</name>
    <message>
        <source>Graph of the pairs that were aligned; the list below it says the same</source>
        <translation>Graph der Paare, die ausgerichtet wurden; die Liste darunter sagt dasselbe</translation>
    </message>
    <message>
        <source>After an alignment: which pairs of volumes were compared, and what each is worth.</source>
        <translation>Nach einem Ausrichten: welche Paare von Volumen verglichen wurden, und was jedes wert ist.</translation>
    </message>
    <message>
        <source>failed</source>
        <translation>fehlgeschlagen</translation>
    </message>
    <message>
        <source>%1 mm</source>
        <translation>%1 mm</translation>
    </message>
</context>
<context>
    <name>echorama::PosePanel</name>
    <message>
        <source>Middle, mm</source>
        <translation>Mitte, mm</translation>
    </message>
    <message>
        <source>Where the middle of the volume is: x to the left, y to the back, z to the head</source>
        <translation>Wo die Mitte des Volumens ist: x nach links, y nach hinten, z zum Kopf</translation>
    </message>
    <message>
        <source>Turned, °</source>
        <translation>Gedreht, °</translation>
    </message>
    <message>
        <source>Rotation about the world&apos;s z, then y, then x</source>
        <translation>Drehung um z, dann y, dann x der Welt</translation>
    </message>
    <message>
        <source>back</source>
        <translation>zurück</translation>
    </message>
    <message>
        <source>on</source>
        <translation>vor</translation>
    </message>
    <message>
        <source>Move by</source>
        <translation>Bewegen</translation>
    </message>
    <message>
        <source>One step %1 along %2</source>
        <translation>Ein Schritt %1 entlang %2</translation>
    </message>
    <message>
        <source>Turn by</source>
        <translation>Drehen</translation>
    </message>
    <message>
        <source>One step %1 about %2, about the centre of rotation</source>
        <translation>Ein Schritt %1 um %2, um den Drehpunkt</translation>
    </message>
    <message>
        <source>Step, mm, °</source>
        <translation>Schritt, mm, °</translation>
    </message>
    <message>
        <source>One step of the keys and of the buttons above, mm</source>
        <translation>Ein Schritt der Tasten und der Knöpfe darüber, mm</translation>
    </message>
    <message>
        <source>One turn of the keys and of the buttons above</source>
        <translation>Eine Drehung der Tasten und der Knöpfe darüber</translation>
    </message>
    <message>
        <source>How far volumes move: 1 with the mouse, 0.1 for fine work</source>
        <translation>Wie weit sich Volumen bewegen: 1 wie die Maus, 0.1 für Feinarbeit</translation>
    </message>
    <message>
        <source>How far volumes turn: 1 with the mouse, 0.1 for fine work</source>
        <translation>Wie weit sich Volumen drehen: 1 wie die Maus, 0.1 für Feinarbeit</translation>
    </message>
    <message>
        <source>&lt;small&gt;moving&lt;/small&gt;</source>
        <translation>&lt;small&gt;bewegen&lt;/small&gt;</translation>
    </message>
    <message>
        <source>&lt;small&gt;turning&lt;/small&gt;</source>
        <translation>&lt;small&gt;drehen&lt;/small&gt;</translation>
    </message>
    <message>
        <source>Turns about</source>
        <translation>Dreht um</translation>
    </message>
    <message>
        <source>The centre of rotation, mm</source>
        <translation>Der Drehpunkt, mm</translation>
    </message>
    <message>
        <source>Middle</source>
        <translation>Mitte</translation>
    </message>
    <message>
        <source>Turn about the middle of what is selected</source>
        <translation>Um die Mitte der Auswahl drehen</translation>
    </message>
    <message>
        <source>Select a volume to move it.</source>
        <translation>Wählen Sie ein Volumen, um es zu bewegen.</translation>
    </message>
    <message>
        <source>%1 and %2 more, which move with it</source>
        <translation>%1 und %2 weitere, die sich mitbewegen</translation>
    </message>
    <message>
        <source>Mouse
speed</source>
        <translation>Maus-
tempo</translation>
    </message>
</context>
<context>
    <name>echorama::ProfilePlot</name>
    <message>
        <source>Profile: grey levels along the distance that was measured</source>
        <translation>Profil: Grauwerte entlang der gemessenen Strecke</translation>
    </message>
    <message>
        <source>Grey levels of each volume along the distance that was measured (tool Measure, key 7), over mm from its first end. Edges of the same tissue at different places are a shift. The mouse, or arrow keys, point at a place.</source>
        <translation>Grauwerte jedes Volumens entlang der gemessenen Strecke (Werkzeug Messen, Taste 7), über mm von ihrem ersten Ende. Kanten desselben Gewebes an verschiedenen Orten sind eine Verschiebung. Die Maus oder die Pfeiltasten zeigen auf einen Ort.</translation>
    </message>
    <message>
        <source>Measure a distance: grey levels along it are shown here.</source>
        <translation>Messen Sie eine Strecke: Grauwerte entlang ihr werden hier gezeigt.</translation>
    </message>
    <message>
        <source>mm</source>
        <translation>mm</translation>
    </message>
</context>
<context>
    <name>echorama::ProjectActions</name>
    <message>
        <source>Save project with its &amp;volumes...</source>
        <translation>Projekt mit seinen V&amp;olumen speichern...</translation>
    </message>
    <message>
        <source>A copy of all files in one folder, which opens on another machine</source>
        <translation>Eine Kopie aller Dateien in einem Ordner, der sich auf einem anderen Rechner öffnet</translation>
    </message>
    <message>
        <source>Name a new folder for the project and its volumes</source>
        <translation>Benennen Sie einen neuen Ordner für das Projekt und seine Volumen</translation>
    </message>
    <message>
        <source>New &amp;folder:</source>
        <translation>Neuer &amp;Ordner:</translation>
    </message>
    <message>
        <source>&amp;Compare with a project or poses...</source>
        <translation>Mit einem Projekt oder Lagen ver&amp;gleichen...</translation>
    </message>
    <message>
        <source>How differently another session places the volumes, mm and degrees</source>
        <translation>Wie anders eine andere Sitzung die Volumen legt, mm und Grad</translation>
    </message>
    <message>
        <source>Compare with</source>
        <translation>Vergleichen mit</translation>
    </message>
    <message>
        <source>Projects and poses (*.json);;All files (*)</source>
        <translation>Projekte und Lagen (*.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Copying project and volumes</source>
        <translation>Projekt und Volumen werden kopiert</translation>
    </message>
    <message>
        <source>Choose another place...</source>
        <translation>Einen anderen Ort wählen...</translation>
    </message>
    <message>
        <source>The project and its volumes are in %1</source>
        <translation>Das Projekt und seine Volumen sind in %1</translation>
    </message>
    <message>
        <source>Open the copy</source>
        <translation>Die Kopie öffnen</translation>
    </message>
    <message>
        <source>Compare with another...</source>
        <translation>Mit einem anderen vergleichen...</translation>
    </message>
    <message>
        <source>Compared with %1</source>
        <translation>Verglichen mit %1</translation>
    </message>
    <message>
        <source>How far apart the two place each volume; it follows what you do here</source>
        <translation>Wie weit auseinander die beiden jedes Volumen legen; es folgt dem, was Sie hier tun</translation>
    </message>
    <message>
        <source>Volume</source>
        <translation>Volumen</translation>
    </message>
    <message>
        <source>Middle, mm</source>
        <translation>Mitte, mm</translation>
    </message>
    <message>
        <source>Farthest corner, mm</source>
        <translation>Fernste Ecke, mm</translation>
    </message>
    <message>
        <source>Turned, °</source>
        <translation>Gedreht, °</translation>
    </message>
    <message>
        <source>&amp;Beside the first volume</source>
        <translation>&amp;Neben dem ersten Volumen</translation>
    </message>
    <message>
        <source>What moved all volumes together is no difference</source>
        <translation>Was alle Volumen gemeinsam bewegt hat, ist kein Unterschied</translation>
    </message>
    <message>
        <source>not there</source>
        <translation>nicht da</translation>
    </message>
    <message>
        <source>Copy &amp;table</source>
        <translation>&amp;Tabelle kopieren</translation>
    </message>
    <message>
        <source>Try again</source>
        <translation>Noch einmal versuchen</translation>
    </message>
</context>
<context>
    <name>echorama::RegistrationPanel</name>
    <message>
        <source>Chooses the file</source>
        <translation>Wählt die Datei</translation>
    </message>
    <message>
        <source>&amp;Refine selected</source>
        <translation>Gewählte &amp;verfeinern</translation>
    </message>
    <message>
        <source>Moves the selected volumes from where they are to where they agree with the others, which stay. Looks within 20 mm and 12 degrees, and farther when that is not enough and you say so</source>
        <translation>Bewegt die gewählten Volumen von ihrer Lage dorthin, wo sie mit den anderen übereinstimmen, die bleiben. Sucht innerhalb von 20 mm und 12 Grad, und weiter, wenn das nicht reicht und Sie es sagen</translation>
    </message>
    <message>
        <source>&amp;Align all</source>
        <translation>&amp;Alle ausrichten</translation>
    </message>
    <message>
        <source>Looks for the place of every volume beside the first</source>
        <translation>Sucht den Ort jedes Volumens neben dem ersten</translation>
    </message>
    <message>
        <source>Where all volumes are before: tracked, within 12 degrees and 20 mm of their places; hand-made, within 35 degrees and a third of a volume; unknown, anywhere; automatic, one after the other while it is not clear</source>
        <translation>Wo die Volumen vorher sind: tracked, innerhalb von 12 Grad und 20 mm ihrer Orte; hand-made, innerhalb von 35 Grad und einem Drittel eines Volumens; unknown, irgendwo; automatic, eins nach dem anderen, solange es nicht klar ist</translation>
    </message>
    <message>
        <source>The likeness by which places are compared</source>
        <translation>Die Ähnlichkeit, nach der Orte verglichen werden</translation>
    </message>
    <message>
        <source>Accept ambiguous results</source>
        <translation>Mehrdeutige Ergebnisse annehmen</translation>
    </message>
    <message>
        <source>Also moves volumes whose result is ambiguous. Failed volumes never move.</source>
        <translation>Bewegt auch Volumen mit mehrdeutigem Ergebnis. Fehlgeschlagene bewegen sich nie.</translation>
    </message>
    <message>
        <source>Tracker</source>
        <translation>Tracker</translation>
    </message>
    <message>
        <source>Recording</source>
        <translation>Aufnahme</translation>
    </message>
    <message>
        <source>The poses of the probe: a tracked sequence or a table</source>
        <translation>Die Lagen der Sonde: eine Sequenz mit Tracking oder eine Tabelle</translation>
    </message>
    <message>
        <source>Recordings (*.mha *.mhd *.nrrd *.csv *.txt);;All files (*)</source>
        <translation>Aufnahmen (*.mha *.mhd *.nrrd *.csv *.txt);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>Tool</source>
        <translation>Werkzeug</translation>
    </message>
    <message>
        <source>The tool that is fixed to the probe, as the recording names it; empty: the only one</source>
        <translation>Das an der Sonde befestigte Werkzeug, wie es die Aufnahme nennt; leer: das einzige</translation>
    </message>
    <message>
        <source>Calibration</source>
        <translation>Kalibrierung</translation>
    </message>
    <message>
        <source>From the volume to the tool, as echorama calibrate hand-eye writes it</source>
        <translation>Vom Volumen zum Werkzeug, wie echorama calibrate hand-eye es schreibt</translation>
    </message>
    <message>
        <source>Calibrations (*.json);;All files (*)</source>
        <translation>Kalibrierungen (*.json);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>&amp;Place by tracker</source>
        <translation>Nach &amp;Tracker legen</translation>
    </message>
    <message>
        <source>Puts all volumes beside the first as the tracker saw them</source>
        <translation>Legt alle Volumen so neben das erste, wie der Tracker sie sah</translation>
    </message>
    <message>
        <source>What came out last; rest the mouse on an answer for its reason</source>
        <translation>Was zuletzt herauskam; die Maus auf einer Antwort zeigt ihren Grund</translation>
    </message>
    <message>
        <source>Volume</source>
        <translation>Volumen</translation>
    </message>
    <message>
        <source>Answer</source>
        <translation>Antwort</translation>
    </message>
    <message>
        <source>Moved</source>
        <translation>Bewegt</translation>
    </message>
    <message>
        <source>Overlap</source>
        <translation>Überlappung</translation>
    </message>
    <message>
        <source>Start</source>
        <translation>Start</translation>
    </message>
    <message>
        <source>Metric</source>
        <translation>Metrik</translation>
    </message>
    <message>
        <source>Refine</source>
        <translation>Verfeinern</translation>
    </message>
    <message>
        <source>Align all</source>
        <translation>Alle ausrichten</translation>
    </message>
    <message>
        <source>%1: two volumes are needed; open another one</source>
        <translation>%1: zwei Volumen sind nötig; öffnen Sie noch eines</translation>
    </message>
    <message>
        <source>Search farther</source>
        <translation>Weiter suchen</translation>
    </message>
    <message>
        <source>Search farther: a volume of before has been removed</source>
        <translation>Weiter suchen: ein Volumen von vorher ist entfernt</translation>
    </message>
    <message>
        <source>Place by tracker</source>
        <translation>Nach Tracker legen</translation>
    </message>
    <message>
        <source>%1: result discarded, because a volume that the others were aligned with was moved in the meantime</source>
        <translation>%1: Ergebnis verworfen, weil ein Volumen, an dem die anderen ausgerichtet wurden, inzwischen bewegt wurde</translation>
    </message>
    <message>
        <source>stays</source>
        <translation>bleibt</translation>
    </message>
    <message>
        <source>it was moved during the alignment and was left where it is</source>
        <translation>es wurde während des Ausrichtens bewegt und blieb, wo es ist</translation>
    </message>
    <message>
        <source>not taken</source>
        <translation>nicht übernommen</translation>
    </message>
    <message>
        <source>%1: %2, %3</source>
        <translation>%1: %2, %3</translation>
    </message>
    <message>
        <source>%1 mm, %2°</source>
        <translation>%1 mm, %2°</translation>
    </message>
    <message>
        <source>%1%</source>
        <translation>%1%</translation>
    </message>
    <message>
        <source>%1: done, %2 moved</source>
        <translation>%1: fertig, %2 bewegt</translation>
    </message>
    <message>
        <source>%1: %2 of %3 volumes aligned; the others were not moved. %4</source>
        <translation>%1: %2 von %3 Volumen ausgerichtet; die anderen wurden nicht bewegt. %4</translation>
    </message>
    <message>
        <source>%1. Only places within %2 mm and %3° were looked at</source>
        <translation>%1. Nur Orte innerhalb von %2 mm und %3° wurden betrachtet</translation>
    </message>
    <message>
        <source>%1% of the smaller volume overlap, similarity %2</source>
        <translation>%1% des kleineren Volumens überlappen, Ähnlichkeit %2</translation>
    </message>
    <message>
        <source>predicted error %1 mm; %2 mm from where the volumes were placed</source>
        <translation>vorhergesagter Fehler %1 mm; %2 mm von dort, wohin die Volumen gelegt wurden</translation>
    </message>
    <message>
        <source>other pairs disagreed with it</source>
        <translation>andere Paare widersprachen ihm</translation>
    </message>
    <message>
        <source>Refine: what is selected was made of other volumes and lies where they lie; select one of those</source>
        <translation>Verfeinern: Was gewählt ist, wurde aus anderen Volumen gemacht und liegt, wo sie liegen; wählen Sie eines von diesen</translation>
    </message>
</context>
<context>
    <name>echorama::ResultPanel</name>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>as the volumes</source>
        <translation>wie die Volumen</translation>
    </message>
    <message>
        <source>Equalise gain</source>
        <translation>Verstärkung angleichen</translation>
    </message>
    <message>
        <source>First gives the volumes the same brightness and contrast where they overlap</source>
        <translation>Gibt den Volumen zuerst dieselbe Helligkeit und denselben Kontrast, wo sie überlappen</translation>
    </message>
    <message>
        <source>Deformable</source>
        <translation>Verformbar</translation>
    </message>
    <message>
        <source>First finds how tissue was deformed between the volumes, and reads them where it belongs</source>
        <translation>Findet zuerst, wie Gewebe zwischen den Volumen verformt wurde, und liest sie, wo es hingehört</translation>
    </message>
    <message>
        <source>Embed in a background</source>
        <translation>In einen Hintergrund einbetten</translation>
    </message>
    <message>
        <source>Puts the result into the fan that holds it, in noise of its own brightness and grain</source>
        <translation>Legt das Ergebnis in den Fächer, der es fasst, in Rauschen seiner Helligkeit und Körnung</translation>
    </message>
    <message>
        <source>Pre&amp;view</source>
        <translation>&amp;Vorschau</translation>
    </message>
    <message>
        <source>Quickly, with voxels twice as large</source>
        <translation>Schnell, mit doppelt so großen Voxeln</translation>
    </message>
    <message>
        <source>&amp;Make</source>
        <translation>&amp;Machen</translation>
    </message>
    <message>
        <source>With full resolution</source>
        <translation>In voller Auflösung</translation>
    </message>
    <message>
        <source>Save result…</source>
        <translation>Ergebnis speichern…</translation>
    </message>
    <message>
        <source>As a file; its extension names the format</source>
        <translation>Als Datei; ihre Endung nennt das Format</translation>
    </message>
    <message>
        <source>Save result</source>
        <translation>Ergebnis speichern</translation>
    </message>
    <message>
        <source>Method</source>
        <translation>Methode</translation>
    </message>
    <message>
        <source>Texture</source>
        <translation>Textur</translation>
    </message>
    <message>
        <source>Voxels</source>
        <translation>Voxel</translation>
    </message>
    <message>
        <source>Margin</source>
        <translation>Rand</translation>
    </message>
    <message>
        <source>Stitch and embed</source>
        <translation>Zusammenfügen und einbetten</translation>
    </message>
    <message>
        <source>Stitch</source>
        <translation>Zusammenfügen</translation>
    </message>
    <message>
        <source>%1 (preview)</source>
        <translation>%1 (Vorschau)</translation>
    </message>
    <message>
        <source>&amp;Compare with sources</source>
        <translation>Mit &amp;Quellen vergleichen</translation>
    </message>
    <message>
        <source>Shows the result alone, and then its sources instead, in all views (T)</source>
        <translation>Zeigt das Ergebnis allein, dann stattdessen seine Quellen, in allen Ansichten (T)</translation>
    </message>
    <message>
        <source>Volumes (%1)</source>
        <translation>Volumen (%1)</translation>
    </message>
    <message>
        <source>What it will be made of</source>
        <translation>Woraus es gemacht wird</translation>
    </message>
    <message>
        <source>Make &amp;again</source>
        <translation>&amp;Neu machen</translation>
    </message>
    <message>
        <source>Of its sources as they are now, as it was made before. What was painted on it is painted again</source>
        <translation>Aus seinen Quellen, wie sie jetzt sind, so, wie es vorher gemacht wurde. Was darauf gemalt wurde, wird wieder gemalt</translation>
    </message>
    <message>
        <source>Result</source>
        <translation>Ergebnis</translation>
    </message>
    <message>
        <source>Which volume is made: a new one, or one that was made before takes other voxels</source>
        <translation>Welches Volumen gemacht wird: ein neues, oder eines, das schon gemacht wurde, erhält andere Voxel</translation>
    </message>
    <message>
        <source>More…</source>
        <translation>Mehr…</translation>
    </message>
    <message>
        <source>Further parameters of the stitching and of the background</source>
        <translation>Weitere Parameter des Zusammenfügens und des Hintergrunds</translation>
    </message>
    <message>
        <source>Results are sources, too</source>
        <translation>Auch Ergebnisse sind Quellen</translation>
    </message>
    <message>
        <source>Also takes volumes that were made of others, when they are shown</source>
        <translation>Nimmt auch Volumen, die aus anderen gemacht wurden, wenn sie gezeigt sind</translation>
    </message>
    <message>
        <source>Sharpness</source>
        <translation>Schärfe</translation>
    </message>
    <message>
        <source>Sharpness of details</source>
        <translation>Schärfe der Details</translation>
    </message>
    <message>
        <source>Scale of details</source>
        <translation>Größe der Details</translation>
    </message>
    <message>
        <source>voxels</source>
        <translation>Voxel</translation>
    </message>
    <message>
        <source>Allow gaps</source>
        <translation>Lücken zulassen</translation>
    </message>
    <message>
        <source>Feather</source>
        <translation>Weicher Rand</translation>
    </message>
    <message>
        <source>automatic</source>
        <translation>automatisch</translation>
    </message>
    <message>
        <source>Kind of outline</source>
        <translation>Art des Umrisses</translation>
    </message>
    <message>
        <source>Keep texture</source>
        <translation>Textur erhalten</translation>
    </message>
    <message>
        <source>Smoothing</source>
        <translation>Glättung</translation>
    </message>
    <message>
        <source>Match grain</source>
        <translation>Körnung angleichen</translation>
    </message>
    <message>
        <source>Match contrast</source>
        <translation>Kontrast angleichen</translation>
    </message>
    <message>
        <source>Spread inside</source>
        <translation>Ausbreitung innen</translation>
    </message>
    <message>
        <source>Spread outside</source>
        <translation>Ausbreitung außen</translation>
    </message>
    <message>
        <source>Noise overlaps</source>
        <translation>Rauschen überlappt um</translation>
    </message>
    <message>
        <source>Seed</source>
        <translation>Startzahl</translation>
    </message>
    <message>
        <source>Outline</source>
        <translation>Umriss</translation>
    </message>
    <message>
        <source>The fan whose form the background has: the smallest that holds the data, or that of a source, which grows until it holds them</source>
        <translation>Der Fächer, dessen Form der Hintergrund hat: der kleinste, der die Daten fasst, oder der einer Quelle, der wächst, bis er sie fasst</translation>
    </message>
    <message>
        <source>Noise volumes</source>
        <translation>Rauschvolumen</translation>
    </message>
    <message>
        <source>noise is made</source>
        <translation>Rauschen wird erzeugt</translation>
    </message>
    <message>
        <source>Files of real noise, which are placed side by side and fill the background; several are parted by ;</source>
        <translation>Dateien mit echtem Rauschen, die nebeneinander gelegt werden und den Hintergrund füllen; mehrere werden durch ; getrennt</translation>
    </message>
    <message>
        <source>Chooses the files</source>
        <translation>Wählt die Dateien</translation>
    </message>
    <message>
        <source>Volumes (%1);;All files (*)</source>
        <translation>Volumen (%1);;Alle Dateien (*)</translation>
    </message>
    <message>
        <source>result</source>
        <translation>Ergebnis</translation>
    </message>
    <message>
        <source>found from the data</source>
        <translation>aus den Daten gefunden</translation>
    </message>
    <message>
        <source>fan of %1</source>
        <translation>Fächer von %1</translation>
    </message>
    <message>
        <source>a new volume</source>
        <translation>ein neues Volumen</translation>
    </message>
    <message>
        <source>No volume is shown.</source>
        <translation>Kein Volumen ist gezeigt.</translation>
    </message>
    <message>
        <source>Of %1</source>
        <translation>Aus %1</translation>
    </message>
    <message>
        <source>%1: sources changed: %2.</source>
        <translation>%1: Quellen geändert: %2.</translation>
    </message>
    <message>
        <source>The volume whose fan was the outline of %1 is gone: the fan is found from the data</source>
        <translation>Das Volumen, dessen Fächer der Umriss von %1 war, ist nicht mehr da: der Fächer wird aus den Daten gefunden</translation>
    </message>
    <message>
        <source>Stitch: %1</source>
        <translation>Zusammenfügen: %1</translation>
    </message>
    <message>
        <source>the sources of %1 are gone</source>
        <translation>die Quellen von %1 sind nicht mehr da</translation>
    </message>
    <message>
        <source>no volume is shown; tick one in the list of volumes</source>
        <translation>kein Volumen ist gezeigt; haken Sie eines in der Liste der Volumen an</translation>
    </message>
    <message>
        <source>Stitch: two volumes are needed, and there is %1 alone</source>
        <translation>Zusammenfügen: zwei Volumen sind nötig, und es gibt nur %1</translation>
    </message>
    <message>
        <source>Stitch: result discarded, because its sources were closed in the meantime</source>
        <translation>Zusammenfügen: Ergebnis verworfen, weil seine Quellen inzwischen geschlossen wurden</translation>
    </message>
    <message>
        <source>Make a result</source>
        <translation>Ein Ergebnis machen</translation>
    </message>
    <message>
        <source>%1%2: %3 × %4 × %5 voxels of %6 mm</source>
        <translation>%1%2: %3 × %4 × %5 Voxel von %6 mm</translation>
    </message>
    <message>
        <source>Preview of </source>
        <translation>Vorschau von </translation>
    </message>
    <message>
        <source>Compare with sources: nothing was stitched yet</source>
        <translation>Mit Quellen vergleichen: noch wurde nichts zusammengefügt</translation>
    </message>
    <message>
        <source>Show %1</source>
        <translation>%1 zeigen</translation>
    </message>
    <message>
        <source>Show the sources of %1</source>
        <translation>Die Quellen von %1 zeigen</translation>
    </message>
</context>
<context>
    <name>echorama::SliceCanvas</name>
    <message>
        <source>Open a volume first.</source>
        <translation>Öffnen Sie zuerst ein Volumen.</translation>
    </message>
    <message>
        <source>Select the one volume to mark in.</source>
        <translation>Wählen Sie das eine Volumen, in dem markiert wird.</translation>
    </message>
    <message>
        <source>Mark %1 in %2</source>
        <translation>%1 in %2 markieren</translation>
    </message>
    <message>
        <source>Select the one volume to paint in.</source>
        <translation>Wählen Sie das eine Volumen, in dem gemalt wird.</translation>
    </message>
</context>
<context>
    <name>echorama::SlicePane</name>
    <message>
        <source>Slice</source>
        <translation>Schicht</translation>
    </message>
    <message>
        <source>What the slice is cut across (V: the next)</source>
        <translation>Quer wozu die Schicht liegt (V: die nächste)</translation>
    </message>
    <message>
        <source>Axial</source>
        <translation>Axial</translation>
    </message>
    <message>
        <source>Coronal</source>
        <translation>Koronal</translation>
    </message>
    <message>
        <source>Sagittal</source>
        <translation>Sagittal</translation>
    </message>
    <message>
        <source>Oblique</source>
        <translation>Schräg</translation>
    </message>
    <message>
        <source>Where the slice is; the wheel over the picture goes by single voxels</source>
        <translation>Wo die Schicht ist; das Rad über dem Bild geht um einzelne Voxel</translation>
    </message>
    <message>
        <source>Where the slice is, along its axis, mm</source>
        <translation>Wo die Schicht ist, entlang ihrer Achse, mm</translation>
    </message>
    <message>
        <source>Fit</source>
        <translation>Einpassen</translation>
    </message>
    <message>
        <source>Show everything (F)</source>
        <translation>Alles zeigen (F)</translation>
    </message>
    <message>
        <source>Make this view large, and back (M, or a double click)</source>
        <translation>Diese Ansicht groß machen, und zurück (M oder ein Doppelklick)</translation>
    </message>
</context>
<context>
    <name>echorama::StatusReadout</name>
    <message>
        <source>Position under the mouse in mm (left, posterior, superior), and the grey level of each volume there</source>
        <translation>Ort unter der Maus in mm (links, hinten, oben) und der Grauwert jedes Volumens dort</translation>
    </message>
    <message>
        <source>and %1 more</source>
        <translation>und %1 weitere</translation>
    </message>
</context>
<context>
    <name>echorama::TrackerPanel</name>
    <message>
        <source>The tracker in one line: igtl://HOST:PORT, polhemus:/dev/ttyUSB0, replay:FILE or simulated:</source>
        <translation>Der Tracker in einer Zeile: igtl://RECHNER:PORT, polhemus:/dev/ttyUSB0, replay:DATEI oder simulated:</translation>
    </message>
    <message>
        <source>The tool that moves volumes</source>
        <translation>Das Werkzeug, das Volumen bewegt</translation>
    </message>
    <message>
        <source>Begins to read the tracker, and ends it</source>
        <translation>Beginnt, den Tracker zu lesen, und beendet es</translation>
    </message>
    <message>
        <source>&amp;Grasp (hold)</source>
        <translation>&amp;Greifen (halten)</translation>
    </message>
    <message>
        <source>While it is held down, the selected volumes follow the tool</source>
        <translation>Solange er gedrückt ist, folgen die gewählten Volumen dem Werkzeug</translation>
    </message>
    <message>
        <source>Tracker</source>
        <translation>Tracker</translation>
    </message>
    <message>
        <source>Tool</source>
        <translation>Werkzeug</translation>
    </message>
    <message>
        <source>State</source>
        <translation>Zustand</translation>
    </message>
    <message>
        <source>Connecting the tracker</source>
        <translation>Der Tracker wird verbunden</translation>
    </message>
    <message>
        <source>Disconnect</source>
        <translation>Trennen</translation>
    </message>
    <message>
        <source>Cancel</source>
        <translation>Abbrechen</translation>
    </message>
    <message>
        <source>&amp;Connect</source>
        <translation>&amp;Verbinden</translation>
    </message>
    <message>
        <source>connecting</source>
        <translation>wird verbunden</translation>
    </message>
    <message>
        <source>not connected</source>
        <translation>nicht verbunden</translation>
    </message>
    <message>
        <source>; %1 poses a second</source>
        <translation>; %1 Lagen je Sekunde</translation>
    </message>
    <message>
        <source>; the tool is not seen</source>
        <translation>; das Werkzeug ist nicht zu sehen</translation>
    </message>
</context>
<context>
    <name>echorama::TrainingPanel</name>
    <message>
        <source>Evaluation</source>
        <translation>Bewertung</translation>
    </message>
    <message>
        <source>none</source>
        <translation>keine</translation>
    </message>
    <message>
        <source>Load truth…</source>
        <translation>Wahrheit laden…</translation>
    </message>
    <message>
        <source>A pose file that says where the volumes belong, such as truth.json of a synthetic set</source>
        <translation>Eine Lagedatei, die sagt, wo die Volumen hingehören, wie truth.json eines synthetischen Satzes</translation>
    </message>
    <message>
        <source>Mean distance of points of the volumes from where they belong, seen from the first volume that has a truth</source>
        <translation>Mittlerer Abstand von Punkten der Volumen von dort, wo sie hingehören, vom ersten Volumen mit Wahrheit aus gesehen</translation>
    </message>
    <message>
        <source>Show the score</source>
        <translation>Die Punktzahl zeigen</translation>
    </message>
    <message>
        <source>In the 3D view: arrows from where points are to where they belong</source>
        <translation>In der 3D-Ansicht: Pfeile von dort, wo Punkte sind, dorthin, wo sie hingehören</translation>
    </message>
    <message>
        <source>Truth</source>
        <translation>Wahrheit</translation>
    </message>
    <message>
        <source>Score</source>
        <translation>Punktzahl</translation>
    </message>
    <message>
        <source>Training</source>
        <translation>Übung</translation>
    </message>
    <message>
        <source>name, may be empty</source>
        <translation>Name, darf leer sein</translation>
    </message>
    <message>
        <source>How far volumes are moved</source>
        <translation>Wie weit Volumen bewegt werden</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>How far volumes are turned</source>
        <translation>Wie weit Volumen gedreht werden</translation>
    </message>
    <message>
        <source>°</source>
        <translation>°</translation>
    </message>
    <message>
        <source>The same number scatters the same volumes in the same way</source>
        <translation>Dieselbe Zahl verstreut dieselben Volumen gleich</translation>
    </message>
    <message>
        <source>Scatter volumes</source>
        <translation>Volumen verstreuen</translation>
    </message>
    <message>
        <source>Moves every volume but the fixed one, in a random direction, by so much from where it belongs (or, without truth, from where it is). Can be undone.</source>
        <translation>Bewegt jedes Volumen außer dem festen in zufälliger Richtung um so viel von dort, wo es hingehört (oder, ohne Wahrheit, von dort, wo es ist). Lässt sich rückgängig machen.</translation>
    </message>
    <message>
        <source>Aligner allowed</source>
        <translation>Ausrichter erlaubt</translation>
    </message>
    <message>
        <source>During an attempt, volumes may be aligned or placed by the program; how often is kept with the attempt</source>
        <translation>Während eines Versuchs darf das Programm Volumen ausrichten oder legen; wie oft, steht beim Versuch</translation>
    </message>
    <message>
        <source>Submit</source>
        <translation>Abgeben</translation>
    </message>
    <message>
        <source>Shows score and errors, and adds the attempt to the history</source>
        <translation>Zeigt Punktzahl und Fehler und fügt den Versuch der Liste an</translation>
    </message>
    <message>
        <source>The file of all attempts, CSV</source>
        <translation>Die Datei aller Versuche, CSV</translation>
    </message>
    <message>
        <source>Keep attempts in…</source>
        <translation>Versuche behalten in…</translation>
    </message>
    <message>
        <source>Adds attempts to another table from now on</source>
        <translation>Fügt Versuche von nun an einer anderen Tabelle an</translation>
    </message>
    <message>
        <source>Trainee</source>
        <translation>Übende Person</translation>
    </message>
    <message>
        <source>Scatter by</source>
        <translation>Verstreuen um</translation>
    </message>
    <message>
        <source>and</source>
        <translation>und</translation>
    </message>
    <message>
        <source>Seed</source>
        <translation>Startzahl</translation>
    </message>
    <message>
        <source>Time</source>
        <translation>Zeit</translation>
    </message>
    <message>
        <source>Attempts</source>
        <translation>Versuche</translation>
    </message>
    <message>
        <source>All attempts, the last one first</source>
        <translation>Alle Versuche, der letzte zuerst</translation>
    </message>
    <message>
        <source>When</source>
        <translation>Wann</translation>
    </message>
    <message>
        <source>Score,
mm</source>
        <translation>Punkte,
mm</translation>
    </message>
    <message>
        <source>From,
mm</source>
        <translation>Von,
mm</translation>
    </message>
    <message>
        <source>Help</source>
        <translation>Hilfe</translation>
    </message>
    <message>
        <source>Load truth</source>
        <translation>Wahrheit laden</translation>
    </message>
    <message>
        <source>Poses (*.json)</source>
        <translation>Lagen (*.json)</translation>
    </message>
    <message>
        <source>Load another truth...</source>
        <translation>Eine andere Wahrheit laden...</translation>
    </message>
    <message>
        <source>Keep attempts in</source>
        <translation>Versuche behalten in</translation>
    </message>
    <message>
        <source>Tables (*.csv)</source>
        <translation>Tabellen (*.csv)</translation>
    </message>
    <message>
        <source>Keep attempts elsewhere...</source>
        <translation>Versuche anderswo behalten...</translation>
    </message>
    <message>
        <source>Scatter: two volumes are needed; open another one</source>
        <translation>Verstreuen: zwei Volumen sind nötig; öffnen Sie noch eines</translation>
    </message>
    <message>
        <source>Submitted: %1 mm after %2, from %3 mm at the start</source>
        <translation>Abgegeben: %1 mm nach %2, von %3 mm am Start</translation>
    </message>
    <message>
        <source>The attempt (%1 mm) was not kept: %2</source>
        <translation>Der Versuch (%1 mm) wurde nicht behalten: %2</translation>
    </message>
    <message>
        <source>%1 mm</source>
        <translation>%1 mm</translation>
    </message>
    <message>
        <source>hidden until you submit</source>
        <translation>verborgen, bis Sie abgeben</translation>
    </message>
    <message>
        <source>needs a truth</source>
        <translation>braucht eine Wahrheit</translation>
    </message>
    <message>
        <source>the project&apos;s</source>
        <translation>die des Projekts</translation>
    </message>
    <message>
        <source>Give up</source>
        <translation>Aufgeben</translation>
    </message>
    <message>
        <source>Start</source>
        <translation>Start</translation>
    </message>
    <message>
        <source>Ends the attempt; nothing is kept</source>
        <translation>Beendet den Versuch; nichts wird behalten</translation>
    </message>
    <message>
        <source>Hides score and errors, and starts the clock; what was done before can no longer be undone</source>
        <translation>Verbirgt Punktzahl und Fehler und startet die Uhr; was vorher getan wurde, lässt sich nicht mehr rückgängig machen</translation>
    </message>
    <message>
        <source>Show error arrows</source>
        <translation>Fehlerpfeile zeigen</translation>
    </message>
    <message>
        <source>Start: %1 is still running; wait for it, or stop it</source>
        <translation>Beginnen: %1 läuft noch; warten Sie darauf, oder brechen Sie es ab</translation>
    </message>
</context>
<context>
    <name>echorama::ViewActions</name>
    <message>
        <source>&amp;Look</source>
        <translation>&amp;Zeigen</translation>
    </message>
    <message>
        <source>Point with the left button: the other slices go there</source>
        <translation>Mit der linken Taste zeigen: die anderen Schichten gehen dorthin</translation>
    </message>
    <message>
        <source>&amp;Align</source>
        <translation>Aus&amp;richten</translation>
    </message>
    <message>
        <source>Drag selected volumes; with Shift they turn; keys x y z keep to an axis</source>
        <translation>Gewählte Volumen ziehen; mit Umschalt drehen sie sich; die Tasten x y z halten an einer Achse</translation>
    </message>
    <message>
        <source>&amp;Paint</source>
        <translation>&amp;Malen</translation>
    </message>
    <message>
        <source>Paint in the selected volume</source>
        <translation>Im gewählten Volumen malen</translation>
    </message>
    <message>
        <source>&amp;Carve</source>
        <translation>&amp;Schnitzen</translation>
    </message>
    <message>
        <source>Take away parts of the selected volume</source>
        <translation>Teile des gewählten Volumens wegnehmen</translation>
    </message>
    <message>
        <source>&amp;Restore</source>
        <translation>&amp;Wiederherstellen</translation>
    </message>
    <message>
        <source>Bring back what was painted over or carved away</source>
        <translation>Zurückholen, was übermalt oder weggeschnitzt wurde</translation>
    </message>
    <message>
        <source>&amp;Mark</source>
        <translation>Mar&amp;kieren</translation>
    </message>
    <message>
        <source>Mark landmarks in the selected volume: the same places in two volumes help to align them; drag one to move it</source>
        <translation>Landmarken im gewählten Volumen setzen: dieselben Orte in zwei Volumen helfen beim Ausrichten; ziehen verschiebt eine</translation>
    </message>
    <message>
        <source>&amp;All</source>
        <translation>&amp;Alle</translation>
    </message>
    <message>
        <source>Slices show all volumes</source>
        <translation>Schichten zeigen alle Volumen</translation>
    </message>
    <message>
        <source>&amp;Selected</source>
        <translation>&amp;Gewählte</translation>
    </message>
    <message>
        <source>Slices show the selected volumes alone</source>
        <translation>Schichten zeigen nur die gewählten Volumen</translation>
    </message>
    <message>
        <source>&amp;Others</source>
        <translation>A&amp;ndere</translation>
    </message>
    <message>
        <source>Slices show the volumes that are not selected</source>
        <translation>Schichten zeigen die Volumen, die nicht gewählt sind</translation>
    </message>
    <message>
        <source>S&amp;witch selected and others</source>
        <translation>Gewählte und andere &amp;wechseln</translation>
    </message>
    <message>
        <source>Flicker: back and forth between the selected volumes and the others</source>
        <translation>Wechselbild: hin und her zwischen den gewählten Volumen und den anderen</translation>
    </message>
    <message>
        <source>&amp;Blend</source>
        <translation>&amp;Überblenden</translation>
    </message>
    <message>
        <source>Volumes are mixed; tints add up to grey where they agree</source>
        <translation>Volumen werden gemischt; Farbtöne ergeben Grau, wo sie übereinstimmen</translation>
    </message>
    <message>
        <source>&amp;Difference</source>
        <translation>&amp;Differenz</translation>
    </message>
    <message>
        <source>Difference between the selected volumes and the others: dark where they agree</source>
        <translation>Differenz zwischen den gewählten Volumen und den anderen: dunkel, wo sie übereinstimmen</translation>
    </message>
    <message>
        <source>&amp;Checkerboard</source>
        <translation>&amp;Schachbrett</translation>
    </message>
    <message>
        <source>Squares of the selected volumes and of the others in turn</source>
        <translation>Felder der gewählten Volumen und der anderen im Wechsel</translation>
    </message>
    <message>
        <source>&amp;Trilinear interpolation</source>
        <translation>&amp;Trilineare Interpolation</translation>
    </message>
    <message>
        <source>Smooth between voxels, or the nearest voxel</source>
        <translation>Glatt zwischen Voxeln, oder das nächste Voxel</translation>
    </message>
    <message>
        <source>&amp;Link slices</source>
        <translation>Schichten &amp;verbinden</translation>
    </message>
    <message>
        <source>Slices share the point in focus and the zoom</source>
        <translation>Schichten teilen den Punkt in der Mitte und die Vergrößerung</translation>
    </message>
    <message>
        <source>Ne&amp;xt axis</source>
        <translation>Nä&amp;chste Achse</translation>
    </message>
    <message>
        <source>Axial, coronal, sagittal: of the view under the mouse</source>
        <translation>Axial, koronal, sagittal: der Ansicht unter der Maus</translation>
    </message>
    <message>
        <source>&amp;Fit</source>
        <translation>&amp;Einpassen</translation>
    </message>
    <message>
        <source>Show everything in all views</source>
        <translation>In allen Ansichten alles zeigen</translation>
    </message>
    <message>
        <source>Reset &amp;grey levels</source>
        <translation>&amp;Grauwerte zurücksetzen</translation>
    </message>
    <message>
        <source>Brightness and contrast as they were at first, before a right drag changed them</source>
        <translation>Helligkeit und Kontrast wie am Anfang, bevor sie durch Ziehen mit der rechten Taste geändert wurden</translation>
    </message>
    <message>
        <source>&amp;Make view large</source>
        <translation>Ansicht g&amp;roß machen</translation>
    </message>
    <message>
        <source>Make the view under the mouse large, and back</source>
        <translation>Die Ansicht unter der Maus groß machen, und zurück</translation>
    </message>
    <message>
        <source>Smaller brush</source>
        <translation>Kleinerer Pinsel</translation>
    </message>
    <message>
        <source>Larger brush</source>
        <translation>Größerer Pinsel</translation>
    </message>
    <message>
        <source>M&amp;easure</source>
        <translation>M&amp;essen</translation>
    </message>
    <message>
        <source>Measure a distance: click on both ends, or drag; the panel Check lists it</source>
        <translation>Eine Strecke messen: auf beide Enden klicken oder ziehen; die Tafel Prüfen führt sie auf</translation>
    </message>
    <message>
        <source>A&amp;ngle</source>
        <translation>Wi&amp;nkel</translation>
    </message>
    <message>
        <source>Measure an angle: click on its three points, the second where its arms meet</source>
        <translation>Einen Winkel messen: auf seine drei Punkte klicken, den zweiten dort, wo sich die Schenkel treffen</translation>
    </message>
    <message>
        <source>&amp;Flicker</source>
        <translation>Wechselbi&amp;ld</translation>
    </message>
    <message>
        <source>Back and forth by itself between two sides (panel Check: which, and how fast); ends when something is dragged</source>
        <translation>Von selbst hin und her zwischen zwei Seiten (Tafel Prüfen: welche und wie schnell); endet, wenn etwas gezogen wird</translation>
    </message>
</context>
<context>
    <name>echorama::ViewPanel</name>
    <message>
        <source>Slices</source>
        <translation>Schichten</translation>
    </message>
    <message>
        <source>Which volumes slices show (A all, S selected, O others, Space switches)</source>
        <translation>Welche Volumen Schichten zeigen (A alle, S gewählte, O andere, Leertaste wechselt)</translation>
    </message>
    <message>
        <source>All</source>
        <translation>Alle</translation>
    </message>
    <message>
        <source>Selected</source>
        <translation>Gewählte</translation>
    </message>
    <message>
        <source>Others</source>
        <translation>Andere</translation>
    </message>
    <message>
        <source>How volumes that overlap are shown (B blend, D difference, K checkerboard)</source>
        <translation>Wie überlappende Volumen gezeigt werden (B überblenden, D Differenz, K Schachbrett)</translation>
    </message>
    <message>
        <source>Blend</source>
        <translation>Überblenden</translation>
    </message>
    <message>
        <source>Difference</source>
        <translation>Differenz</translation>
    </message>
    <message>
        <source>Checkerboard</source>
        <translation>Schachbrett</translation>
    </message>
    <message>
        <source>Between voxels (N switches)</source>
        <translation>Zwischen Voxeln (N wechselt)</translation>
    </message>
    <message>
        <source>Trilinear</source>
        <translation>Trilinear</translation>
    </message>
    <message>
        <source>Nearest voxel</source>
        <translation>Nächstes Voxel</translation>
    </message>
    <message>
        <source>Side of the squares of the checkerboard, pixels</source>
        <translation>Kante der Felder des Schachbretts, Pixel</translation>
    </message>
    <message>
        <source>Grey level that is drawn black (right drag in a slice changes both, G brings them back)</source>
        <translation>Grauwert, der schwarz gezeichnet wird (rechts ziehen in einer Schicht ändert beide, G bringt sie zurück)</translation>
    </message>
    <message>
        <source>Grey level that is drawn white (right drag in a slice changes both, G brings them back)</source>
        <translation>Grauwert, der weiß gezeichnet wird (rechts ziehen in einer Schicht ändert beide, G bringt sie zurück)</translation>
    </message>
    <message>
        <source>Show</source>
        <translation>Zeigen</translation>
    </message>
    <message>
        <source>Mode</source>
        <translation>Modus</translation>
    </message>
    <message>
        <source>Voxels</source>
        <translation>Voxel</translation>
    </message>
    <message>
        <source>Squares</source>
        <translation>Felder</translation>
    </message>
    <message>
        <source>Black</source>
        <translation>Schwarz</translation>
    </message>
    <message>
        <source>White</source>
        <translation>Weiß</translation>
    </message>
    <message>
        <source>3D view</source>
        <translation>3D-Ansicht</translation>
    </message>
    <message>
        <source>How volumes are drawn in 3D</source>
        <translation>Wie Volumen in 3D gezeichnet werden</translation>
    </message>
    <message>
        <source>Particles</source>
        <translation>Teilchen</translation>
    </message>
    <message>
        <source>Volume</source>
        <translation>Volumen</translation>
    </message>
    <message>
        <source>Outline</source>
        <translation>Umriss</translation>
    </message>
    <message>
        <source>One particle for so many voxels along each axis; more is faster and coarser</source>
        <translation>Ein Teilchen für so viele Voxel je Achse; mehr ist schneller und gröber</translation>
    </message>
    <message>
        <source>Size of particles; at 1 they touch</source>
        <translation>Größe der Teilchen; bei 1 berühren sie sich</translation>
    </message>
    <message>
        <source>Opacity; lower values let you see into the volumes</source>
        <translation>Deckkraft; kleinere Werte lassen in die Volumen sehen</translation>
    </message>
    <message>
        <source>Dark is transparent</source>
        <translation>Dunkles ist durchsichtig</translation>
    </message>
    <message>
        <source>Opacity grows with the grey level, so that fluid and shadows are seen through</source>
        <translation>Die Deckkraft wächst mit dem Grauwert, so dass man durch Flüssigkeit und Schatten sieht</translation>
    </message>
    <message>
        <source>Darker voxels are hidden in 3D</source>
        <translation>Dunklere Voxel sind in 3D verborgen</translation>
    </message>
    <message>
        <source>Brighter voxels are hidden in 3D</source>
        <translation>Hellere Voxel sind in 3D verborgen</translation>
    </message>
    <message>
        <source>Slices in 3D</source>
        <translation>Schichten in 3D</translation>
    </message>
    <message>
        <source>Draws the slices with their pictures in the 3D view</source>
        <translation>Zeichnet die Schichten mit ihren Bildern in die 3D-Ansicht</translation>
    </message>
    <message>
        <source>Drawn as</source>
        <translation>Gezeichnet als</translation>
    </message>
    <message>
        <source>Downsampling</source>
        <translation>Vergröberung</translation>
    </message>
    <message>
        <source>Particle size</source>
        <translation>Teilchengröße</translation>
    </message>
    <message>
        <source>Opacity</source>
        <translation>Deckkraft</translation>
    </message>
    <message>
        <source>Hide below</source>
        <translation>Verbergen unter</translation>
    </message>
    <message>
        <source>Hide above</source>
        <translation>Verbergen über</translation>
    </message>
    <message>
        <source>Plane in numbers</source>
        <translation>Ebene in Zahlen</translation>
    </message>
    <message>
        <source>The slice whose plane this is</source>
        <translation>Die Schicht, deren Ebene dies ist</translation>
    </message>
    <message>
        <source>Upper left</source>
        <translation>Oben links</translation>
    </message>
    <message>
        <source>Upper right</source>
        <translation>Oben rechts</translation>
    </message>
    <message>
        <source>Lower left</source>
        <translation>Unten links</translation>
    </message>
    <message>
        <source>The direction that the slice is seen from (left, posterior, superior); any length. It becomes oblique. Shift and middle drag in the slice turns it, too.</source>
        <translation>Die Richtung, aus der die Schicht gesehen wird (links, hinten, oben); beliebige Länge. Sie wird schräg. Auch Umschalt und Ziehen mit der mittleren Taste in der Schicht dreht sie.</translation>
    </message>
    <message>
        <source>How far the plane is from the origin of the world, along its normal</source>
        <translation>Wie weit die Ebene vom Ursprung der Welt entfernt ist, entlang ihrer Normalen</translation>
    </message>
    <message>
        <source> mm</source>
        <translation> mm</translation>
    </message>
    <message>
        <source>Of</source>
        <translation>Von</translation>
    </message>
    <message>
        <source>Normal</source>
        <translation>Normale</translation>
    </message>
    <message>
        <source>Offset</source>
        <translation>Abstand</translation>
    </message>
    <message>
        <source>A plane needs a normal that is not zero.</source>
        <translation>Eine Ebene braucht eine Normale, die nicht null ist.</translation>
    </message>
</context>
<context>
    <name>echorama::VolumePane</name>
    <message>
        <source>3D view</source>
        <translation>3D-Ansicht</translation>
    </message>
    <message>
        <source>How volumes are drawn in 3D</source>
        <translation>Wie Volumen in 3D gezeichnet werden</translation>
    </message>
    <message>
        <source>Particles</source>
        <translation>Teilchen</translation>
    </message>
    <message>
        <source>Volume</source>
        <translation>Volumen</translation>
    </message>
    <message>
        <source>Outline</source>
        <translation>Umriss</translation>
    </message>
    <message>
        <source>Fit</source>
        <translation>Einpassen</translation>
    </message>
    <message>
        <source>Show everything (F)</source>
        <translation>Alles zeigen (F)</translation>
    </message>
    <message>
        <source>Make this view large, and back (M, or a double click)</source>
        <translation>Diese Ansicht groß machen, und zurück (M oder ein Doppelklick)</translation>
    </message>
</context>
<context>
    <name>echorama::VolumePanel</name>
    <message>
        <source>Volumes</source>
        <translation>Volumen</translation>
    </message>
    <message>
        <source>All</source>
        <translation>Alle</translation>
    </message>
    <message>
        <source>Select all volumes (Ctrl+A)</source>
        <translation>Alle Volumen wählen (Strg+A)</translation>
    </message>
    <message>
        <source>None</source>
        <translation>Keine</translation>
    </message>
    <message>
        <source>Select no volume (Ctrl+D)</source>
        <translation>Kein Volumen wählen (Strg+D)</translation>
    </message>
    <message>
        <source>Invert</source>
        <translation>Umkehren</translation>
    </message>
    <message>
        <source>Select those that are not selected (Ctrl+I)</source>
        <translation>Die wählen, die nicht gewählt sind (Strg+I)</translation>
    </message>
    <message>
        <source>Group</source>
        <translation>Gruppe</translation>
    </message>
    <message>
        <source>Keep the selected volumes together (Ctrl+G)</source>
        <translation>Die gewählten Volumen beisammen halten (Strg+G)</translation>
    </message>
    <message>
        <source>Tint of %1</source>
        <translation>Farbton von %1</translation>
    </message>
    <message>
        <source>Make again</source>
        <translation>Neu machen</translation>
    </message>
    <message>
        <source>Makes the result of its sources as they are now</source>
        <translation>Macht das Ergebnis aus seinen Quellen, wie sie jetzt sind</translation>
    </message>
    <message>
        <source>%1: sources changed</source>
        <translation>%1: Quellen geändert</translation>
    </message>
</context>
<context>
    <name>echorama::VolumeTable</name>
    <message>
        <source>Not from a file</source>
        <translation>Nicht aus einer Datei</translation>
    </message>
    <message>
        <source>Show</source>
        <translation>Zeigen</translation>
    </message>
    <message>
        <source>Name</source>
        <translation>Name</translation>
    </message>
    <message>
        <source>Opacity</source>
        <translation>Deckkraft</translation>
    </message>
    <message>
        <source>Group</source>
        <translation>Gruppe</translation>
    </message>
    <message>
        <source>Shown in the views. Only volumes that are shown are stitched and exported; aligning uses all of them</source>
        <translation>In den Ansichten gezeigt. Nur gezeigte Volumen werden zusammengefügt und exportiert; das Ausrichten nutzt alle</translation>
    </message>
    <message>
        <source>Tint of the volume; double click to change it</source>
        <translation>Farbton des Volumens; ein Doppelklick ändert ihn</translation>
    </message>
    <message>
        <source>Double click to rename</source>
        <translation>Ein Doppelklick benennt um</translation>
    </message>
    <message>
        <source>Weight of the volume where several overlap; double click to change it</source>
        <translation>Gewicht des Volumens, wo mehrere überlappen; ein Doppelklick ändert es</translation>
    </message>
    <message>
        <source>Volumes of one group are selected and moved together</source>
        <translation>Volumen einer Gruppe werden zusammen gewählt und bewegt</translation>
    </message>
    <message>
        <source>Made of %1. %2. %3</source>
        <translation>Gemacht aus %1. %2. %3</translation>
    </message>
    <message>
        <source>Its sources are as they were</source>
        <translation>Seine Quellen sind, wie sie waren</translation>
    </message>
    <message>
        <source>Sources changed: %1</source>
        <translation>Quellen geändert: %1</translation>
    </message>
    <message>
        <source>It is in no file yet</source>
        <translation>Es ist noch in keiner Datei</translation>
    </message>
</context>
<context>
    <name>echorama::Workbench</name>
    <message>
        <source>%1: not during an attempt; give it up first, or allow it before the next one</source>
        <translation>%1: nicht während eines Versuchs; geben Sie ihn erst auf, oder erlauben Sie es vor dem nächsten</translation>
    </message>
</context>
</TS>
