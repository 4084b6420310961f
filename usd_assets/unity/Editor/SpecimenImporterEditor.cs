// SPDX-License-Identifier: Apache-2.0
using UnityEditor;
using UnityEditor.AssetImporters;
using UnityEngine;

namespace StereoCell.Editor
{
    /// <summary>The importer's Inspector: its options, and a field for each channel to use one of the project's own
    /// materials.</summary>
    [CustomEditor(typeof(SpecimenImporter))]
    public sealed class SpecimenImporterEditor : ScriptedImporterEditor
    {
        public override void OnInspectorGUI()
        {
            serializedObject.Update();
            EditorGUILayout.PropertyField(serializedObject.FindProperty("options"), new GUIContent("Options"), true);
            serializedObject.ApplyModifiedProperties();
            var importer = (SpecimenImporter)target;
            var made = AssetDatabase.LoadAssetAtPath<GameObject>(importer.assetPath);
            if (made != null) Materials(importer, made.GetComponent<Specimen>());
            ApplyRevertGUI();
        }

        static void Materials(SpecimenImporter importer, Specimen specimen)
        {
            EditorGUILayout.LabelField("Materials of surfaces");
            var map = importer.GetExternalObjectMap();
            foreach (var channel in specimen.channels)
            {
                var key = SpecimenImporter.MaterialOf(channel.id);
                Object before;
                map.TryGetValue(key, out before);
                var after = EditorGUILayout.ObjectField(channel.name, before, typeof(Material), false);
                if (after == before) continue;
                if (after == null) importer.RemoveRemap(key);
                else importer.AddRemap(key, after);
                importer.SaveAndReimport();
            }
        }
    }
}
